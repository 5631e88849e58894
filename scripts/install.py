"""Installs the package, editable, into this Python: first the pinned requirements by their hashes, then itself alone.

Where the pinned versions cannot be had, as for a Python that is newer than they are, it says so in one line and
installs the newest that fit.

python scripts/install.py run.txt|all.txt|dev.txt
"""

from __future__ import annotations

import re
import subprocess
import sys

from make_constraints import FILES, FOLDER, ROOT, stale

PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input", "-q", "install")


def main(arguments: list[str]) -> int:
    """Install what one of the files holds, and the package."""
    name, *rest = arguments or [""]
    if name not in FILES or rest:
        print(f"give one of {', '.join(FILES)}", file=sys.stderr)
        return 2
    reason = "they are older than pyproject.toml" if stale(name) else pinned(name)
    if not reason:
        return 0
    print(f"Not the versions of constraints/{name} ({reason}): the newest that fit are installed", flush=True)
    extras = f"[{','.join(FILES[name])}]" if FILES[name] else ""
    return subprocess.run([*PIP, "--no-compile", "-e", f".{extras}"], cwd=ROOT).returncode


def pinned(name: str) -> str:
    """Install by hashes; return the reason in a line where that fails, else nothing."""
    for step in (
        ["--require-hashes", "-r", str(FOLDER / name), "--no-compile"],
        ["--no-deps", "--no-build-isolation", "-e", "."],
    ):
        done = subprocess.run([*PIP, *step], cwd=ROOT, capture_output=True, text=True)
        if done.returncode:
            said = re.findall(r"^error: (.+)", done.stderr, flags=re.MULTILINE | re.IGNORECASE)
            return said[-1] if said else "pip failed"
    return ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
