"""What the arm's tests share."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ilg_circuit.arms import Arm, strip_arm


@pytest.fixture(scope="session")
def strip() -> Arm:
    """The paper's strip, weightless and undamped."""
    return replace(strip_arm(), damping=0.0)
