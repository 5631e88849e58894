"""One thread for linear algebra: the matrices of a study are too small to gain from more."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit the linear algebra of numpy and scipy to one thread within the block."""
    from threadpoolctl import threadpool_limits

    import_module("scipy.linalg")  # the limit applies to loaded libraries only
    with threadpool_limits(1):
        yield
