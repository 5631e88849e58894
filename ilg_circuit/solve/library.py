"""Finding ngspice's shared library on Linux, macOS and Windows, and handing it to PySpice."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from ..errors import MissingLibraryError

VARIABLE = "NGSPICE_LIBRARY_PATH"

INSTALL_HINT = (
    "ngspice's shared library was not found; install it (Debian, Ubuntu: apt install libngspice0; Fedora: dnf install "
    f"libngspice; macOS: brew install libngspice) or set {VARIABLE} to the file"
)

_PATTERNS = {
    "linux": ("libngspice.so", "libngspice.so.[0-9]*"),
    "darwin": ("libngspice.dylib", "libngspice.[0-9]*.dylib"),
    "win32": ("ngspice.dll", "libngspice*.dll"),
}


def find_library() -> Path:
    """Path of the shared library: the environment variable, the Python environment, then the system.

    Raises MissingLibraryError with one line that says what to install.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if Path(named).is_file():
            return Path(named)
        raise MissingLibraryError(f"{VARIABLE} is '{named}', which is no file; set it to ngspice's library or unset it")
    for folder in _folders():
        for pattern in _PATTERNS.get(sys.platform, _PATTERNS["linux"]):
            for path in sorted(folder.glob(pattern)):
                return path
    found = ctypes.util.find_library("ngspice")
    if found:
        return Path(found)
    raise MissingLibraryError(INSTALL_HINT)


def prepare_library() -> Path:
    """Find the library, load what lies unpacked beside it, and name it to PySpice, before PySpice is imported."""
    path = find_library()
    private = Path(sys.prefix) / "lib" / "ngspice"
    if private in path.parents:
        # unpacked without root: the dynamic linker does not know this folder, so its neighbours are loaded first
        for neighbour in sorted(private.rglob("*.so.*")):
            if not neighbour.name.startswith("libngspice"):
                with suppress(OSError):
                    ctypes.CDLL(str(neighbour), mode=ctypes.RTLD_GLOBAL)
    os.environ[VARIABLE] = str(path)
    return path


def _folders() -> Iterator[Path]:
    private = Path(sys.prefix) / "lib" / "ngspice"
    yield private
    if private.is_dir():
        yield from sorted(p for p in private.rglob("*") if p.is_dir())
    yield Path(sys.prefix) / "lib"
    yield Path(sys.prefix) / "Library" / "bin"
    if sys.platform == "darwin":
        yield from (Path("/opt/homebrew/lib"), Path("/usr/local/lib"))
        yield from (Path("/opt/homebrew/opt/libngspice/lib"), Path("/usr/local/opt/libngspice/lib"))
    elif sys.platform == "win32":
        yield from (Path(p) for p in os.environ.get("PATH", "").split(os.pathsep) if p)
        yield Path("C:/Spice64_dll/dll-vs")
    else:
        yield from (Path("/usr/local/lib"), Path("/usr/lib64"), Path("/usr/lib"))
        yield from sorted(Path("/usr/lib").glob("*-linux-gnu*"))
