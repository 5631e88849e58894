"""A window's session without a browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.window.session import Session


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


@pytest.fixture
def record(tmp_path: Path) -> Callable[..., Path]:
    """A record of the paper's strip under 4 V without its displacement, with noise and a rest, under these titles."""

    def made(name: str = "step.csv", titles: str = "time_s,voltage_V,current_A") -> Path:
        run = ilg.simulate("paper", "step:4V", "60 s", samples=121, engine="exact")
        random = np.random.default_rng(3)
        rest = np.column_stack([np.arange(0, 5, 0.5), np.zeros(10), np.zeros(10)])
        rows = np.vstack([rest, np.column_stack([run.time + 5, run.voltage, run.current])])
        rows[:, 2] += 5e-4 * random.standard_normal(len(rows))
        path = tmp_path / name
        text = "\n".join(",".join(f"{x:.7g}" for x in row) for row in rows)
        path.write_text(f"{titles}\n{text}\n", encoding="utf-8")
        return path

    return made
