"""What the tests of couplings that relax share: strips of each, and scipy's answer for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from spice import MODELS

from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.couplings import ChargeCoupling, RelaxingCoupling, VoltageRelaxations
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]

TWO = {"gain_1": 90e-9, "time_1": 5.0, "gain_2": -30e-9, "time_2": 40.0}
FRACTIONAL = {"fractional_gain": 40e-9, "fractional_time": 7.0, "fractional_exponent": 0.6}

COUPLINGS: dict[str, RelaxingCoupling] = {
    "charge": ChargeCoupling(**TWO, instantaneous=20e-9),
    "charge alone": ChargeCoupling(instantaneous=90e-9),
    "charge fractional": ChargeCoupling(**FRACTIONAL, gain_1=-20e-9, time_1=90.0),
    "voltage": VoltageRelaxations(**TWO, gain_3=5e-9, time_3=0.5),
    "voltage fractional": VoltageRelaxations(**FRACTIONAL),
}


def strip(coupling: str | RelaxingCoupling, model: str = "rc") -> Actuator:
    """The paper's strip of an electrical ``model`` with another coupling."""
    chosen = COUPLINGS[coupling] if isinstance(coupling, str) else coupling
    return replace(MODELS.get(model, PAPER), coupling=chosen)


def by_scipy(actuator: Actuator, voltage: float, times: Array, q_of_v: object = None) -> tuple[Array, Array]:
    """Charge [C] and free displacement [m] after a step of ``voltage`` [V], one branch, static beam, no Re.

    ``q_of_v`` maps a charge to the voltage of the capacitance; by default v + slope v abs(v)/2 is solved for.
    """
    lumped = lumped_elements(actuator)
    law = actuator.coupling
    assert isinstance(law, RelaxingCoupling)
    ((resistance, capacitance),) = lumped.port.branches
    slope = lumped.port.capacitance_slope
    gains = np.array([r.gain for r in law.relaxations])
    taus = np.array([r.time for r in law.relaxations])

    def across(q: float) -> float:
        if callable(q_of_v):
            return float(q_of_v(q))
        x = q / capacitance
        return float(np.sign(x) * (np.sqrt(1 + 2 * slope * abs(x)) - 1) / slope) if slope else x

    def bent(q: float) -> float:
        x = q / capacitance if law.follows_charge else voltage
        return x + (law.odd or 0.0) * x * abs(x) + (law.even or 0.0) * x * x

    def rates(_: float, y: Array) -> Array:
        return np.array([(voltage - across(y[0])) / resistance, *((bent(y[0]) - y[1:]) / taus)])

    start = np.zeros(1 + len(taus))
    found = solve_ivp(rates, (0, times[-1]), start, method="Radau", rtol=1e-10, atol=1e-13, t_eval=times)
    moved = lumped.bending_ratio * (
        gains @ found.y[1:] + (law.instantaneous or 0.0) * np.array([bent(q) for q in found.y[0]])
    )
    return found.y[0], np.asarray(moved)
