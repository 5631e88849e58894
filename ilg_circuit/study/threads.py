"""One thread for linear algebra: a study's matrices are small, and threads would only wait for one another."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module


@contextmanager
def one_thread() -> Iterator[None]:
    """While it lasts, numpy's and scipy's linear algebra use one thread; another process's load then costs little."""
    from threadpoolctl import threadpool_limits

    import_module("scipy.linalg")  # a library can be told only once it is loaded
    with threadpool_limits(1):
        yield
