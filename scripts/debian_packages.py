"""Takes files out of Debian's packages without root: for a virtual environment, and for a wheel that carries ngspice.

Needs nothing but Python and apt: builds of wheels use it, where the package itself is not installed.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

#: What a wheel carries; all else that they need is part of any system that wheels for Linux are made for.
CARRIED = ("libngspice0", "libgomp1")
_LICENCES = "usr/share/common-licenses"


@contextmanager
def apt_room() -> Iterator[tuple[Path, list[str]]]:
    """Give a folder, and an apt-get that works in it, as anybody may, with the lists of today."""
    with tempfile.TemporaryDirectory() as folder:
        room = Path(folder)
        for name in ("state/lists/partial", "cache/archives/partial", "debs", "root", "kept"):
            (room / name).mkdir(parents=True)
        options = {
            "Dir::State": room / "state",
            "Dir::State::status": "/var/lib/dpkg/status",
            "Dir::Cache": room / "cache",
            "Acquire::Languages": "none",
            "APT::Sandbox::User": "root",  # only root would change user, and that user cannot enter this folder
        }
        apt = ["apt-get", *(f"-o{name}={value}" for name, value in options.items())]
        run(*apt, "update", check=False)
        yield room, apt


def unpack(room: Path, apt: list[str], *packages: str) -> None:
    """Download packages, whose signatures apt checks, and unpack them into ``root``."""
    run(*apt, "download", *packages, cwd=room / "debs")
    for package in (room / "debs").iterdir():
        run("dpkg-deb", "-x", str(package), str(room / "root"))


def carry(folder: Path) -> tuple[int, int]:
    """Put the libraries of `CARRIED` and their licences into ``folder``; return the version of glibc that they need.

    Raises OSError or CalledProcessError where Debian's packages cannot be had.
    """
    with apt_room() as (room, apt):
        unpack(room, apt, *CARRIED)
        root = room / "root"
        # a package whose documents are those of another one: the licence is in that
        docs = root / "usr" / "share" / "doc"
        if others := [path.readlink().name for name in CARRIED if (path := docs / name).is_symlink()]:
            unpack(room, apt, *others)
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("libngspice.so.0", "libgomp.so.1"):  # the names by which others ask for them
            shutil.copy(next(root.rglob(name)), folder / name)
        texts = {name: (docs / name / "copyright").read_text(encoding="utf-8") for name in CARRIED}
        for name, text in texts.items():
            (folder / f"{name}.copyright.txt").write_text(text, encoding="utf-8")
        for name in set(re.findall(rf"/{_LICENCES}/([\w.-]*\w)", "\n".join(texts.values()))):
            if (Path("/") / _LICENCES / name).is_file():
                shutil.copy(Path("/") / _LICENCES / name, folder / f"{name}.txt")
        said = (
            "Unchanged from these packages of Debian; their sources are at https://snapshot.debian.org/ by version.\n"
        )
        lines = [said]
        for path in sorted((room / "debs").iterdir()):
            name, version, source = run(
                "dpkg-deb",
                "--show",
                "--showformat=${Package}\n${Version}\n${source:Package} ${source:Version}",
                str(path),
            ).split("\n")
            lines.append(
                f"{name} {version} (source {source}), sha256 {hashlib.sha256(path.read_bytes()).hexdigest()}\n"
            )
        (folder / "made_from.txt").write_text("".join(lines), encoding="utf-8")
    needed = re.findall(rb"GLIBC_(\d+)\.(\d+)", b"".join(path.read_bytes() for path in folder.glob("*.so*")))
    return max((int(major), int(minor)) for major, minor in needed)


def run(*command: str, check: bool = True, cwd: Path | None = None) -> str:
    environment = os.environ | {"LC_ALL": "C"}  # the output is read
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, cwd=cwd, env=environment, check=check
    )
    return done.stdout


def last_line(error: Exception) -> str:
    lines = str(getattr(error, "stderr", "") or error).strip().splitlines()
    return lines[-1] if lines else type(error).__name__
