"""A PI controller that identifies its strip while it runs, and reschedules its gains: for a strip that dries.

A model of the strip runs beside it under the same voltage. Recursive least squares with a forgetting factor move the
model's parameters, logarithms of factors on what was fitted, by the error of its displacement and its derivatives with
respect to them. The gains keep the loop gain what it was tuned to be at its crossover.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import expm

from ..arrays import Array
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..errors import InputError, argument
from ..solve.state_space import StateSpace, state_space
from ..strip.actuator import Actuator
from .drift import GAIN, changed
from .laws import Law, law_of
from .margins import frequencies
from .plant import Plant, plants_of
from .sampled import SampledLaw

#: Time over which the past is forgotten [s], noise of a measurement [m], and error of a factor at the start.
MEMORY, NOISE, DOUBT = 50.0, 1e-5, 0.3
#: Shift of a logarithm for a derivative; change at which the model is made anew; largest of a logarithm.
_SHIFT, _ANEW, _FARTHEST = 1e-4, 5e-3, float(np.log(20.0))
#: Largest correction of a logarithm, in a time constant of the strip.
_AT_ONCE = 0.3


class Adaptive:
    """An adaptive PI controller with ``step(reference, measured)``, called every ``period`` [s] from rest on.

    ``estimates`` has the factors found at each call by name, ``gains`` those of the PI now [SI].
    """

    def __init__(
        self,
        actuator: Actuator,
        law: Law,
        period: float,
        limit: float,
        *,
        estimated: tuple[str, ...] = (),
        memory: float = MEMORY,
        noise: float = NOISE,
        beam: str | None = None,
        load: Load | None = None,
    ) -> None:
        if law.kind != "pi":
            raise InputError(f"an adaptive controller is a PI, not {law.kind}; tune one of that kind")
        for name, value, unit in (("period", period, "s"), ("memory", memory, "s"), ("noise", noise, "m")):
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{argument(name)} is {value:g} {unit}; it must be more than zero")
        self.plant = plants_of(actuator, beam=beam, load=load)[0]
        assert actuator.coupling is not None
        if not actuator.material.model.linear or not actuator.coupling.linear:
            raise InputError(f"actuator '{actuator.name}' is nonlinear; an adaptive controller is for linear strips")
        follows = actuator.coupling.follows_charge
        self.names = estimated or (("capacitance", "dynamic_resistance") if follows else (GAIN,))
        changed(actuator, dict.fromkeys(self.names, 1.0))
        self.actuator, self.law, self.period, self.limit = actuator, law, period, limit
        self._how: dict[str, Any] = {"beam": beam, "load": load}
        self._forgets, self._noise = float(np.exp(-period / memory)), noise
        self._most = _AT_ONCE * period * float(np.abs(self.plant.poles.real).min())
        count = len(self.names)
        self.estimates: dict[str, list[float]] = {name: [] for name in self.names}
        self.gains = dict(law.gains)
        self._crossover = _crossover(self.plant, law)
        self._wanted = law.response(self._crossover)[0] * self.plant.response(self._crossover)[0]
        self._logs, self._doubt = np.zeros(count), DOUBT**2 * np.eye(count)
        self._pi = SampledLaw(law, period, limit)
        self._model(np.zeros(count))
        self._states = np.zeros((count + 1, self._moved.shape[1] - 1))

    def step(self, reference: float, measured: float) -> float:
        """Return the limited voltage [V] for a reference and a measured displacement [m]."""
        shown = np.einsum("ns,ns->n", self._rows, self._states)
        slopes = (shown[1:] - shown[0]) / _SHIFT
        missed = measured - shown[0] - slopes @ (self._logs - self._at)
        spread = self._doubt @ slopes
        # a large correction is of slopes that hold no longer: the reading then counts as a noisier one
        weighed = self._forgets * self._noise**2 + slopes @ spread
        weight = spread / max(weighed, float(np.abs(spread * missed).max()) / self._most)
        self._logs = np.clip(self._logs + weight * missed, -_FARTHEST, _FARTHEST)
        values, axes = np.linalg.eigh((self._doubt - np.outer(weight, spread)) / self._forgets)
        self._doubt = (axes * np.clip(values, 0.0, DOUBT**2)) @ axes.T  # nothing is forgotten beyond the start
        for name, log in zip(self.names, self._logs.tolist(), strict=True):
            self.estimates[name].append(float(np.exp(log)))
        if np.abs(self._logs - self._at).max() > _ANEW:
            self._anew()
        voltage = self._pi.step(reference, measured)
        held = self._moved[:, :-1, -1] * voltage
        self._states = np.einsum("nij,nj->ni", self._moved[:, :-1, :-1], self._states) + held
        return voltage

    def _model(self, logs: Array) -> None:
        """Make the model with its derivatives about the logarithms (p,) of its factors."""
        shifted = [logs, *(logs + _SHIFT * row for row in np.eye(len(logs)))]
        strips = [changed(self.actuator, dict(zip(self.names, np.exp(at).tolist(), strict=True))) for at in shifted]
        system = state_space([strip_netlist(strip, **self._how) for strip in strips])
        row = system.output_names.index("displacement")
        n = system.a.shape[1]
        whole = np.zeros((len(strips), n + 1, n + 1))
        whole[:, :n, :n], whole[:, :n, n] = system.a, system.b[:, :, 0]
        self._moved, self._rows, self._at = expm(whole * self.period), system.c[:, row], logs.copy()
        self._system = system

    def _anew(self) -> None:
        """Go on with the model about the present estimate, and with the gains that suit it."""
        along = (self._states[1:] - self._states[0]) / _SHIFT
        self._states = self._states + (self._logs - self._at) @ along
        self._model(self._logs)
        self.gains |= self._scheduled(self._system)
        state = self._pi.state
        self._pi = SampledLaw(law_of("pi", self.plant, self.gains), self.period, self.limit)
        self._pi.state = state

    def _scheduled(self, system: StateSpace) -> dict[str, float]:
        """Return gain and reset time with which the loop gain at the crossover is the one that was tuned."""
        omega = float(self._crossover[0])
        row = system.c[0, system.output_names.index("displacement")]
        moved = row @ np.linalg.solve(1j * omega * np.eye(len(row)) - system.a[0], system.b[0, :, 0])
        wanted = self._wanted / moved
        if wanted.real > 0 > wanted.imag:
            return {"gain": float(wanted.real), "reset_time": float(-wanted.real / (omega * wanted.imag))}
        return {"gain": self.law.gains["gain"] * float(abs(self.plant.response(self._crossover)[0] / moved))}


def _crossover(plant: Plant, law: Law) -> Array:
    """Return the highest angular frequency [rad/s] at which the loop gain is 1, shape (1,)."""
    frequency = frequencies([plant], law)
    size = np.abs(plant.response(frequency) * law.response(frequency))
    return frequency[[int(np.flatnonzero(size >= 1).max(initial=0))]]
