"""Electrical models registered from outside the package, carried to the workers of a sweep."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

#: Modules that a worker can import: everything else is pickled by value.
_IMPORTABLE = ("ilg_circuit", "numpy", "scipy", "builtins")


def packed_models() -> bytes:
    """Return the outside models, pickled by value with the modules that define them; empty where there are none."""
    models = tuple(_registry().registered())
    if not models:
        return b""
    with _by_value(models) as cloudpickle:
        packed: bytes = cloudpickle.dumps(models)
    return packed


def unpack_models(packed: bytes) -> None:
    """In a worker: register the models of `packed_models` that are not there yet."""
    if not packed:
        return
    registry = _registry()
    known = {model.name for model in registry.registered()}
    for model in pickle.loads(packed):
        if model.name not in known:
            registry.register(model)


def _registry() -> Any:
    return import_module("ilg_circuit.strip.models.registry")


@contextmanager
def _by_value(models: Iterable[Any]) -> Iterator[Any]:
    """Yield cloudpickle, which within the block copies the modules that define ``models`` and their functions."""
    cloudpickle: Any = import_module("cloudpickle")  # untyped
    parts = [part for model in models for part in (type(model), *vars(model).values()) if hasattr(part, "__module__")]
    names = {str(part.__module__) for part in parts}
    modules = [sys.modules[n] for n in names if n in sys.modules and n.partition(".")[0] not in _IMPORTABLE]
    for module in modules:
        cloudpickle.register_pickle_by_value(module)
    try:
        yield cloudpickle
    finally:
        for module in modules:
            cloudpickle.unregister_pickle_by_value(module)
