"""Electrical models registered by a user's module reach workers that cannot import it."""

import sys
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import pytest

pytest.importorskip("loky", reason="workers are an extra")
from ilg_circuit.study.workers import packed_models, unpack_models

USER = """
from dataclasses import dataclass
from typing import Any

def impedance(s: float) -> float:
    return helper(s) + 1.0

def helper(s: float) -> float:
    return 2.0 * s

@dataclass(frozen=True)
class Line:
    name: str = "line"
    impedance: Any = impedance
"""


@dataclass
class Registry:
    models: list[Any] = field(default_factory=list)

    def registered(self) -> list[Any]:
        return self.models

    def register(self, model: Any) -> None:
        self.models.append(model)


@pytest.fixture
def registry(monkeypatch: pytest.MonkeyPatch) -> Registry:
    found = Registry()
    monkeypatch.setattr("ilg_circuit.study.workers.registry", found)
    return found


def test_models_travel_by_value(registry: Registry, monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("users_line")
    monkeypatch.setitem(sys.modules, "users_line", module)
    exec(USER, module.__dict__)
    registry.register(module.__dict__["Line"]())
    packed = packed_models()
    monkeypatch.delitem(sys.modules, "users_line")  # as in a worker on another machine
    registry.models.clear()
    unpack_models(packed)
    unpack_models(packed)  # every task brings them; they are registered once
    assert [model.name for model in registry.models] == ["line"]
    assert registry.models[0].impedance(3.0) == 7.0


def test_without_models_nothing_travels(registry: Registry) -> None:
    assert packed_models() == b""
    unpack_models(b"")
    assert registry.models == []
