"""The paper's strip with a covariance: that of a fit to its own 4 V step with 1 % noise."""

import pytest
from synthetic import record, step

import ilg_circuit as ilg
from ilg_circuit.strip.actuator import Actuator


@pytest.fixture(scope="session")
def fitted() -> Actuator:
    measured = record(step(), 300.0, 201, rest=10, displacement=True, seed=1, noise=0.01).measurement()
    return ilg.identify(measured, "paper", model="rc", onset="first-level", engine="exact").actuator
