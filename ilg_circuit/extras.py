"""What an optional part of the package needs beyond its own requirements, and what to say where it is not there."""

from __future__ import annotations

from importlib.util import find_spec

from .errors import MissingLibraryError

_ARM = ("numba", "xarray", "h5netcdf", "h5py", "PIL")


def require_arm() -> None:
    """Raise MissingLibraryError, which says what to install, where the extra ``arm`` is not installed."""
    missing = [name for name in _ARM if find_spec(name) is None]
    if missing:
        names = ", ".join(missing).replace("PIL", "pillow")
        raise MissingLibraryError(f"the arm needs {names}: install with pip install 'ilg-circuit[arm]'")
