"""The strip as a controller sees it: voltage to displacement at L_F, or to the blocked force, a small state space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..errors import InputError, argument
from ..simulation.prediction_band import scaled
from ..simulation.waveforms import WAVEFORMS
from ..solve.balance import balanced
from ..solve.state_space import state_space
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements
from ..strip.ladder import LADDER_BAND

#: How the tip is mounted, by the quantity that is controlled there.
TIPS = {"displacement": "free", "force": "clamped"}
#: Largest Markov parameter that counts as zero, relative to the scale of the poles.
_ZERO = 1e-6
#: Speed of a pole that counts as none, in parts of the fastest.
_STILL = 1e-7
#: Condition of eigenvectors above which a response is not summed from modes.
_NEARLY_PARALLEL = 1e6


@dataclass(frozen=True, eq=False)
class Plant:
    """x' = A x + B u, y = C x for voltage u [V] and displacement or force y in ``unit``: a (s, s), b (s,), c (s,)."""

    a: Array
    b: Array
    c: Array
    unit: str = "m"

    @property
    def gain(self) -> float:
        """Displacement [m/V] or force [N/V] at rest."""
        return float(-self.c @ np.linalg.solve(self.a, self.b))

    @property
    def poles(self) -> ComplexArray:
        """Poles [1/s] (s,)."""
        return np.asarray(np.linalg.eigvals(self.a), dtype=complex)

    def response(self, frequency: Array) -> ComplexArray:
        """Return y/u [m/V] at angular frequencies [rad/s] (f,)."""
        return responses([self], frequency)[0]

    def leading(self) -> tuple[int, float]:
        """Return the relative degree n and the gain b0 of y^(n) = b0 u + ... at once after a change of u."""
        scale = float(np.abs(self.poles).max())
        row, size = self.c, abs(self.gain)
        for degree in range(1, len(self.b) + 1):
            value = float(row @ self.b)
            if abs(value) > _ZERO * size * scale**degree:
                return degree, value
            row = row @ self.a
        raise InputError("the strip's voltage does not move its tip")


def speeds(a: Array) -> Array:
    """Return the speeds [1/s] of the poles of A but those of integrators, which stand still up to rounding."""
    found = np.abs(np.linalg.eigvals(a).real)
    return np.asarray(found[found > _STILL * found.max()])


def responses(plants: list[Plant], frequency: Array) -> ComplexArray:
    """Return y/u [m/V] of plants of one order at angular frequencies [rad/s] (f,), shape (plants, f)."""
    a, b, c = (np.stack([getattr(plant, part) for plant in plants]) for part in ("a", "b", "c"))
    poles, shapes = np.linalg.eig(a)
    if np.linalg.cond(shapes).max() < _NEARLY_PARALLEL:
        shares = np.linalg.solve(shapes, b[..., None].astype(complex))[..., 0] * np.einsum("ns,nsk->nk", c, shapes)
        total = np.zeros((len(plants), len(frequency)), dtype=complex)
        for k in range(a.shape[1]):
            total += shares[:, k, None] / (1j * frequency - poles[:, k, None])
        return total
    matrix = 1j * frequency[:, None, None] * np.eye(a.shape[1]) - a[:, None]
    right = np.broadcast_to(b[:, None, :, None], (*matrix.shape[:3], 1)).astype(complex)
    return np.asarray(np.einsum("ns,nfs->nf", c, np.linalg.solve(matrix, right)[..., 0]))


def plants_of(
    actuator: Actuator,
    *,
    beam: str | None = None,
    load: Load | None = None,
    draws: int = 0,
    seed: int = 0,
    quantity: str = "displacement",
) -> list[Plant]:
    """Return the linearised strip, then ``draws`` samples of its fit's covariance, all of one order.

    The tip is that of `TIPS`. A clamped strip has no inertia: its force is that of the static beam, without the voltage
    that the force reflects, whose share is that of the energy converted, 1e-10 in the paper's strip. Raises InputError
    for a strip without a coupling, or draws from one without a covariance.
    """
    if actuator.coupling is None:
        raise InputError(f"actuator '{actuator.name}' has no [coupling]; its tip cannot be controlled")
    how: dict[str, Any] = {"tip": TIPS[quantity], "beam": "static" if quantity == "force" else beam, "load": load}
    strips = [actuator, *sampled(actuator, draws, seed)]
    nets = [strip_netlist(strip, **how, band=LADDER_BAND).linearised() for strip in strips]
    system = state_space(nets)
    row = system.output_names.index(quantity)
    order = 0
    found = []
    for a, b, c in zip(system.a, system.b[:, :, 0], system.c[:, row], strict=True):
        plant = Plant(*balanced(a, b, c, order), WAVEFORMS[quantity].unit)
        order = len(plant.b)
        found.append(plant)
    return found


def unit_of(quantity: str) -> str:
    """Return the unit of a quantity that a voltage controls. Raises InputError for another one."""
    if quantity not in TIPS:
        raise InputError(f"{argument('quantity')} is '{quantity}'; choose {' or '.join(TIPS)}")
    return WAVEFORMS[quantity].unit


def sampled(actuator: Actuator, draws: int, seed: int) -> list[Actuator]:
    """Return ``draws`` strips, their parameters drawn from the covariance. Raises InputError without one."""
    if not draws:
        return []
    uncertainty = actuator.uncertainty
    if uncertainty is None:
        raise InputError(f"actuator '{actuator.name}' has no [uncertainty]: fit one with identify, or ask for no draws")
    random = np.random.default_rng(seed)
    mean = np.zeros(len(uncertainty.names))
    logs = random.multivariate_normal(mean, np.array(uncertainty.covariance), size=draws, method="eigh")
    return [
        scaled(actuator, dict(zip(uncertainty.names, np.exp(row).tolist(), strict=True)), LADDER_BAND) for row in logs
    ]


def first_mode(actuator: Actuator, beam: str | None = None, load: Load | None = None) -> float | None:
    """Return the resonance of the tip [Hz], None for a beam without mass."""
    if actuator.beam(beam, loaded=bool(load)) == "static":
        return None
    load = load or Load()
    lumped = lumped_elements(actuator, hung=load.mass)
    stiffness = lumped.stiffness + lumped.gravity + load.stiffness
    return float(np.sqrt(stiffness / (lumped.mass + load.mass)) / (2 * np.pi))
