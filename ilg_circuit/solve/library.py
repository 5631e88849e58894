"""Finds ngspice's shared library on Linux, macOS and Windows, hands it to PySpice, and says what to do without it."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import platform
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from ..errors import MissingLibraryError, warn

VARIABLE = "NGSPICE_LIBRARY_PATH"

#: Value of the variable that hides every library.
NONE = "none"

#: Linux distribution, or one that it is like -> the command that installs the library.
_BY_DISTRIBUTION = {
    "debian": "sudo apt install libngspice0",
    "ubuntu": "sudo apt install libngspice0",
    "fedora": "sudo dnf install libngspice",
    "arch": "sudo pacman -S ngspice",
    "suse": "sudo zypper install libngspice0",
    "opensuse": "sudo zypper install libngspice0",
}
_BY_PLATFORM = {"darwin": "brew install libngspice", "win32": "pyspice-post-installation --install-ngspice-dll"}
_BY_CONDA = "conda install -c conda-forge ngspice-lib"

_PATTERNS = {
    "linux": ("libngspice.so", "libngspice.so.[0-9]*"),
    "darwin": ("libngspice.dylib", "libngspice.[0-9]*.dylib"),
    "win32": ("ngspice.dll", "libngspice*.dll", "ngspice-[0-9]*.dll"),
}


def private_folder() -> Path:
    """Return the folder of the Python environment into which the library may be unpacked without root."""
    return Path(sys.prefix) / "lib" / "ngspice"


def carried_folder() -> Path:
    """Return the folder of the library that a wheel may carry, for systems that have none."""
    return Path(__file__).with_name("carried")


def find_library() -> Path:
    """Return the shared library's path: the environment variable's, the environment's, the system's, the wheel's.

    Raises MissingLibraryError, a line with what to install.
    """
    path = next(candidates(), None)
    if path is None:
        raise MissingLibraryError(install_hint())
    return path


def available() -> bool:
    """Return True if there is a library. Raises MissingLibraryError where the variable names no file."""
    return next(candidates(), None) is not None


def chosen_engine(engine: str | None, *, linear: bool) -> str:
    """Return the engine: the one asked for, else ngspice; where there is no library, exact, with a warning.

    Raises MissingLibraryError for a circuit that is not ``linear``, which only ngspice solves.
    """
    if engine is not None:
        return engine
    if available():
        return "ngspice"
    if not linear:
        raise MissingLibraryError(f"a nonlinear circuit needs ngspice; {install_hint()}")
    warn(f"solved by the exact engine, since {install_hint()}")
    return "exact"


def install_hint() -> str:
    """Return what to say where there is no library."""
    if os.environ.get(VARIABLE) == NONE:
        return f"{VARIABLE} is '{NONE}', which hides ngspice's library; unset it"
    return f"ngspice's shared library was not found; install it by: {install_command()} (or set {VARIABLE} to the file)"


def install_command() -> str:
    """Return the one command that installs the library on this platform."""
    if (Path(sys.prefix) / "conda-meta").is_dir():
        return _BY_CONDA
    if command := _BY_PLATFORM.get(sys.platform):
        return command
    try:
        release = platform.freedesktop_os_release()
    except OSError:
        return _BY_CONDA
    names = [release.get("ID", ""), *release.get("ID_LIKE", "").split()]
    return next((_BY_DISTRIBUTION[name] for name in names if name in _BY_DISTRIBUTION), _BY_CONDA)


def candidates() -> Iterator[Path]:
    """Yield the files that may be the library, the first choice first; nothing but the variable's, if it is set.

    Raises MissingLibraryError where the variable names no file.
    """
    named = os.environ.get(VARIABLE)
    if named == NONE:
        return
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
    yield from sorted(carried_folder().glob("libngspice*"))


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
    """Load what an unpacked library needs from its own folder, which the dynamic linker does not know.

    Of the wheel's folder only where the library does not load without: the system's are preferred.
    """
    for folder in (private_folder(), carried_folder()):
        if folder in library.parents and not (folder == carried_folder() and _loaded(library)):
            left = [path for path in sorted(folder.rglob("*.so*")) if not path.name.startswith("libngspice")]
            for _ in list(left):  # they may need each other: as many rounds as could ever help
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
        yield from (Path(conda) / "lib", Path(conda) / "Library" / "bin")
    yield Path(sys.prefix) / "Library" / "bin"
    if sys.platform == "darwin":
        yield from (Path("/opt/homebrew/lib"), Path("/usr/local/lib"))
        yield from (Path("/opt/homebrew/opt/libngspice/lib"), Path("/usr/local/opt/libngspice/lib"))
    elif sys.platform == "win32":
        yield from (Path(p) for p in os.environ.get("PATH", "").split(os.pathsep) if p)
        yield Path("C:/Spice64_dll/dll-vs")
        if pyspice := find_spec("PySpice"):  # where its post-installation puts it
            yield Path(str(pyspice.origin)).parent / "Spice" / "NgSpice" / "Spice64_dll" / "dll-vs"
    else:
        yield from (Path("/usr/local/lib"), Path("/usr/lib64"), Path("/usr/lib"))
        yield from sorted(Path("/usr/lib").glob("*-linux-gnu*"))
