"""The array types that annotations name, arrays as plain data, and the threads of their linear algebra."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError
from .extras import whole

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Mask = NDArray[np.bool_]


def plain(values: Array) -> list[float | None]:
    """Return ``values`` (n,) as JSON takes them: None for what is not finite."""
    return [value if np.isfinite(value) else None for value in values.tolist()]


def row(values: ArrayLike, what: str) -> Array:
    """Return ``values`` as one row of numbers (n,), masked ones as nan.

    Raises InputError naming ``what`` where they are none.
    """
    if np.iscomplexobj(values):
        raise InputError(f"{what} holds complex numbers; give their real and imaginary parts as columns")
    if is_clock(values):
        raise InputError(f"{what} holds dates or durations; give it as numbers")
    try:
        masked = isinstance(values, np.ma.MaskedArray)
        found = np.ma.filled(np.ma.asarray(values, dtype=float), np.nan) if masked else np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what} holds something else than numbers") from None
    if found.ndim != 1:
        raise InputError(f"{what} has the shape {found.shape}; give one row of numbers")
    return found


def is_clock(values: ArrayLike) -> bool:
    """Return True for numpy's and pandas' durations and dates.

    >>> is_clock(np.array([3], dtype="timedelta64[s]")), is_clock([3.0])
    (True, False)
    """
    return getattr(getattr(values, "dtype", None), "kind", "") in ("m", "M")


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit the linear algebra of numpy and scipy to one thread within the block, or in the function it decorates.

    Matrices here are small: more threads wait for each other, and take twice the processor's time or more.
    """
    from threadpoolctl import threadpool_limits

    with whole():
        import_module("scipy.linalg")  # the limit applies to loaded libraries only
    with threadpool_limits(1):
        yield
