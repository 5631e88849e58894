"""Writes constraints/*.txt: versions with hashes that `make` installs, for every Python and system.

Needs uv (pip install uv) and the network. A file is replaced whole; --check only says whether any is out of date with
pyproject.toml, and needs neither.

python scripts/make_constraints.py [--check]
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "constraints"

#: File -> extras of the package whose requirements it holds.
FILES = {"run.txt": (), "all.txt": ("all",), "dev.txt": ("dev",)}
#: What hatchling needs besides for an editable install.
EDITABLE = "editables>=0.5"
#: Extras that are in none of the files.
NOT_IN_THEM = ("bench", "peers")
HEAD = """\
# Versions with hashes, for every Python and system that the package supports; written by scripts/make_constraints.py.
# Use: pip install --require-hashes -r constraints/{name} && pip install --no-deps --no-build-isolation .
# requirements: {digest}
"""


def main(arguments: list[str]) -> int:
    """Write the files, or check them; 1 where one is out of date or cannot be written."""
    if "--check" in arguments:
        for name in filter(stale, FILES):
            print(f"constraints/{name} is out of date: run python scripts/make_constraints.py")
        return any(map(stale, FILES))
    for name, extras in FILES.items():
        try:
            text = HEAD.format(name=name, digest=digest()) + compiled(extras)
        except (OSError, subprocess.CalledProcessError) as error:
            reason = str(getattr(error, "stderr", None) or error).strip().splitlines()[-1]
            print(f"constraints/{name}: cannot be made: {reason}", file=sys.stderr)
            return 1
        (FOLDER / name).write_text(text, encoding="utf-8")
        print(f"constraints/{name}: {text.count('==')} packages")
    return 0


def stale(name: str) -> bool:
    """Return True where a file was not made from what pyproject.toml requires now."""
    return digest() not in _text(FOLDER / name)


def digest() -> str:
    """Return a digest of all that pyproject.toml requires."""
    given = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = given["project"]
    extras = {n: e for n, e in project["optional-dependencies"].items() if n not in NOT_IN_THEM}
    parts = [
        given["build-system"]["requires"],
        project["requires-python"],
        project["dependencies"],
        sorted(extras.items()),
    ]
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def compiled(extras: tuple[str, ...]) -> str:
    """Return the requirements with hashes, and those of the build, which runs without a network."""
    given = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        build = Path(folder) / "build.in"
        build.write_text("\n".join([*given["build-system"]["requires"], EDITABLE]), encoding="utf-8")
        command = [sys.executable, "-m", "uv", "pip", "compile", "--universal", "--generate-hashes", "--no-annotate"]
        command += ["--no-header", "--quiet", "--python-version", given["project"]["requires-python"].lstrip(">=")]
        command += [part for extra in extras for part in ("--extra", extra)]
        done = subprocess.run(
            [*command, "pyproject.toml", str(build)], cwd=ROOT, capture_output=True, text=True, check=True
        )
    return done.stdout


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.is_file() else ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
