"""Finds ngspice's shared library on Linux, macOS and Windows, and hands it to PySpice."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
from collections.abc import Iterator
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


def private_folder() -> Path:
    """Return the folder of the Python environment into which the library may be unpacked without root."""
    return Path(sys.prefix) / "lib" / "ngspice"


def find_library() -> Path:
    """Return the path of the shared library: the environment variable, the Python environment, then the system.

    Raises MissingLibraryError, a line with what to install.
    """
    path = next(candidates(), None)
    if path is None:
        raise MissingLibraryError(INSTALL_HINT)
    return path


def candidates() -> Iterator[Path]:
    """Yield the files that may be the library, the first choice first; nothing but the variable's, if it is set.

    Raises MissingLibraryError where the variable names no file.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if not Path(named).is_file():
            raise MissingLibraryError(
                f"{VARIABLE} is '{named}', which is not a file; set it to ngspice's library or unset it"
            )
        yield Path(named)
        return
    for folder in _folders():
        for pattern in _PATTERNS.get(sys.platform, _PATTERNS["linux"]):
            yield from sorted(folder.glob(pattern))
    if known := ctypes.util.find_library("ngspice"):
        yield Path(known)


def loads(library: Path) -> bool:
    """Load a library; return False if it cannot be loaded: another processor's, or without its dependencies."""
    _load_neighbours(library)
    return _loaded(library)


def prepare_library() -> Path:
    """Return the library after loading its unpacked dependencies and giving its path to PySpice, before its import."""
    path = find_library()
    _load_neighbours(path)
    os.environ[VARIABLE] = str(path)
    return path


def _load_neighbours(library: Path) -> None:
    """Load the dependencies of a library in the private folder, which the dynamic linker does not search."""
    if private_folder() not in library.parents:
        return
    left = [path for path in sorted(private_folder().rglob("*.so*")) if not path.name.startswith("libngspice")]
    for _ in list(left):  # they may depend on each other: one round per file suffices
        left = [path for path in left if not _loaded(path, ctypes.RTLD_GLOBAL)]


def _loaded(path: Path, mode: int = ctypes.DEFAULT_MODE) -> bool:
    try:
        ctypes.CDLL(str(path), mode=mode)
    except OSError:
        return False
    return True


def _folders() -> Iterator[Path]:
    private = private_folder()
    yield private
    if private.is_dir():
        yield from sorted(p for p in private.rglob("*") if p.is_dir())
    yield Path(sys.prefix) / "lib"
    if conda := os.environ.get("CONDA_PREFIX"):
        yield Path(conda) / "lib"
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
