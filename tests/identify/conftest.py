"""Fits that several tests look at from different sides, made once."""

from __future__ import annotations

import pytest
from synthetic import Record, record, step

from ilg_circuit.actuator import PAPER
from ilg_circuit.identify import Identification, identify


@pytest.fixture(scope="session")
def step_record() -> Record:
    """The paper's strip, 4 V for 300 s, 20 samples of rest, noise of 0.3 %."""
    return record(step(), 300.0, 301, rest=20, displacement=True, noise=0.003, rest_position=5e-3, seed=11)


@pytest.fixture(scope="session")
def step_fit(step_record: Record) -> Identification:
    return identify(step_record.measurement(), base=PAPER, model="rc")
