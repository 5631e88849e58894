"""Loads libraries whole, and checks that the optional ones are there; its errors say what to install."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from types import FrameType

from .errors import MissingLibraryError


@contextmanager
def whole() -> Iterator[None]:
    """Hold back Ctrl-C within the block, and raise KeyboardInterrupt at its end.

    Compiled modules turn an interrupt of their import into an ImportError, and some cannot be imported again in the
    same process. Only Python's own handler is held back, and only in the main thread, where it runs.
    """
    listening = threading.current_thread() is threading.main_thread()
    if not listening or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    came: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        came.append(number)

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if came:
            raise KeyboardInterrupt


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
