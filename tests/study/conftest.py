"""Sweeps of few designs in several tasks."""

import pytest

from ilg_circuit.study import spec as questions


@pytest.fixture
def small_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tasks of four designs, so that few designs make several."""
    monkeypatch.setattr(questions, "_DESIGNS", 4)
