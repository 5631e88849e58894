"""Checks the optional requirements of parts of the package, and raises errors with what to install."""

from __future__ import annotations

from importlib.util import find_spec

from .errors import MissingLibraryError


def require_arm() -> None:
    """Raise MissingLibraryError, which says what to install, where the extra ``arm`` is not installed."""
    _require(("numba", "xarray", "h5netcdf", "h5py", "PIL"), "the arm", "arm")


def require_study(*, cluster: bool = False) -> None:
    """Raise MissingLibraryError without the libraries of a sweep: the extra ``study``, for a ``cluster`` its own."""
    _require(("loky", "xarray", "h5netcdf", "h5py"), "a sweep", "study")
    if cluster:
        _require(("distributed",), "a cluster", "cluster")


def require_sensitivity() -> None:
    """Raise MissingLibraryError without the libraries for Sobol indices: the extra ``sensitivity``."""
    _require(("SALib",), "Sobol indices", "sensitivity")


def require_control() -> None:
    """Raise MissingLibraryError, which says what to install, where the extra ``control`` is not installed."""
    _require(("clarabel",), "the voltage for a path", "control")


def require_python_control() -> None:
    """Raise MissingLibraryError without python-control, for a strip as its state space: the extra ``control``."""
    _require(("control",), "a strip for python-control", "control")


def require_dataframe(module: str) -> None:
    """Raise MissingLibraryError without ``module``, pandas or xarray, for a result: the extra ``dataframe``."""
    _require((module,), f"a result as a table of {module}", "dataframe")


def require_app() -> None:
    """Raise MissingLibraryError without the library of the window: the extra ``app``."""
    _require(("panel",), "the window", "app")


def require_netcdf() -> None:
    """Raise MissingLibraryError without the libraries for netCDF files: the extra ``study``."""
    _require(("xarray", "h5netcdf", "h5py"), "a netCDF file", "study")


def require_reader(module: str, what: str) -> None:
    """Raise MissingLibraryError without the ``module`` of the extra ``formats`` that reads a file ``what``."""
    _require((module,), what, "formats")


def _require(modules: tuple[str, ...], what: str, extra: str) -> None:
    missing = [name for name in modules if find_spec(name) is None]
    if missing:
        names = ", ".join(missing).replace("PIL", "pillow")
        raise MissingLibraryError(f"{what} needs {names}: install with pip install 'ilg-circuit[{extra}]'")
