"""Kernels that are kept between processes."""

from __future__ import annotations

import importlib
import inspect
import pkgutil

from ilg_circuit import arms


def test_no_kernel_is_a_generator() -> None:
    """Numba does not find a generator that an earlier process has left: a second kernel that uses it cannot be made."""
    modules = [
        importlib.import_module(f"{arms.__name__}.{found.name}") for found in pkgutil.iter_modules(arms.__path__)
    ]
    plain = {k.py_func for module in modules for k in vars(module).values() if hasattr(k, "py_func")}
    assert len(plain) > 10
    assert not [function.__qualname__ for function in plain if inspect.isgeneratorfunction(function)]
