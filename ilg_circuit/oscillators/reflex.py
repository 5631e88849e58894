"""Neurons, the strips that they drive, and the feedback of the strips' angles into the neurons: CPG Figure 9.

    u = Vmax clip(out/A_ref, -1, 1)     out = y_extensor - y_flexor, for each unit
    theta = P(s) u                      P: the circuit of the unit's segment, its free curvature times its length
    s = F sin(2 pi f t) - h (theta - theta_ref)      enters the extensor as + s and the flexor as - s

A positive gain h [1/rad] is the stretch reflex: a bend towards the extensor stretches the other side, and excites the
flexor. A negative one assists what bends. F is an input from outside, to which a rhythm may lock.

Each unit bends a segment of its own; one unit the whole strip. A linear strip's loop is piecewise linear, like the
neurons: the voltage's limits switch as their outputs do. So it is solved by the same exact `flow`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..circuit.netlist import Netlist
from ..circuit.strip import strip_netlist
from ..errors import InputError, argument
from ..simulation.curvature import curvature_probe
from ..solve.balance import balanced
from ..solve.state_space import state_space
from ..strip.actuator import Actuator
from ..strip.electrodes import require_lump
from ..strip.ladder import LADDER_BAND
from ..units import require_positive
from .flow import Active, Flow, Stretch
from .network import Network
from .outcome import Rhythm
from .rhythm import rhythm

#: The paper's voltage [V].
LARGEST_VOLTAGE = 4.0
_LARGEST_GAIN = 1e9
#: A voltage this close to its limit, relative to it, is there.
_AT_LIMIT = 1e-13


@dataclass(frozen=True)
class Forcing:
    """A sine of ``amplitude`` F and ``frequency`` [Hz] into all units; it starts at zero."""

    amplitude: float
    frequency: float


class Plant(NamedTuple):
    """z' = a z + b u, angle [rad] = c z + direct u of a segment under a voltage u [V]."""

    a: Array
    b: Array
    c: Array
    direct: float


@dataclass(frozen=True)
class Loop:
    """A network, the strip that each unit drives, and the feedback.

    ``strip`` is the segment of one unit; ``gain`` h [1/rad]; ``rest_angle`` theta_ref [rad]; ``voltage`` Vmax [V];
    ``reference`` A_ref. Raises InputError for a strip that cannot bend so, or numbers out of range.
    """

    network: Network
    strip: Actuator
    gain: float
    reference: float
    rest_angle: float = 0.0
    voltage: float = LARGEST_VOLTAGE
    forcing: Forcing | None = None

    def __post_init__(self) -> None:
        require_positive("voltage", self.voltage, "V")
        if not (math.isfinite(self.reference) and self.reference > 0):
            raise InputError(
                f"reference {self.reference:g} must be more than zero and finite: the output that gives Vmax"
            )
        if not abs(self.gain) <= _LARGEST_GAIN:
            raise InputError(f"{argument('reflex')} is {self.gain:g}; give a finite gain [1/rad], such as 0.5")
        if not abs(self.rest_angle) <= 1e3:
            raise InputError(f"rest angle is {self.rest_angle:g} rad; it must be finite")
        require_lump(self.strip, "a reflex")
        if self.strip.coupling is None:
            raise InputError(f"strip '{self.strip.name}' has no [coupling]: it does not bend, so no reflex can feel it")

    @property
    def units(self) -> int:
        """Number of units, and of segments."""
        return len(self.network.units)

    @cached_property
    def free(self) -> Rhythm:
        """Rhythm of the neurons that feel nothing, from the paper's start."""
        return rhythm(self.network)

    @cached_property
    def netlist(self) -> Netlist:
        """The strip of a unit with the one output ``angle`` [rad]."""
        net = strip_netlist(self.strip, beam="static", band=LADDER_BAND)
        (probe,) = curvature_probe(self.strip, LADDER_BAND)
        length = self.strip.geometry.free_length
        angle = replace(probe, name="angle", unit="rad", terms=tuple((q, length * k) for q, k in probe.terms))
        return replace(net, outputs=(angle,))

    @cached_property
    def plant(self) -> Plant:
        """From voltage to angle in states of about one at the largest.

        Raises InputError for a nonlinear strip.
        """
        if not self.strip.linear:
            raise InputError(
                f"strip '{self.strip.name}' is not linear; a loop with it is solved by {argument('engine', 'ngspice')}"
            )
        system = state_space([self.netlist])
        if not np.abs(system.c[0, 0]).max(initial=0.0):  # the angle follows the voltage at once, and nothing else
            return Plant(-np.eye(1), np.zeros(1), np.zeros(1), self.direct)
        a, b, c = balanced(system.a[0], system.b[0, :, 0], system.c[0, 0])
        scale = float(np.linalg.norm(c)) / (abs(c @ np.linalg.solve(a, b)) * self.voltage or 1.0)
        return Plant(a, b * scale, c / scale, self.direct)

    @cached_property
    def direct(self) -> float:
        """Angle that follows a small voltage at once [rad/V]."""
        return float(state_space([self.netlist.linearised()]).d[0, 0, 0])

    def voltages(self, outputs: Array) -> Array:
        """Return the voltages [V] (t, units) on the strips for ``outputs`` (t, units) of the units."""
        return self.voltage * np.clip(outputs / self.reference, -1.0, 1.0)

    def inputs(self, time: Array, angles: Array) -> Array:
        """Return the inputs s (t, units) at ``time`` [s] (t,) with ``angles`` [rad] (t, units)."""
        forcing = self.forcing or Forcing(0.0, 0.0)
        forced = forcing.amplitude * np.sin(2 * np.pi * forcing.frequency * time)
        return np.asarray(forced[:, None] - self.gain * (angles - self.rest_angle))

    def forced(self, amplitude: float, frequency: float) -> Loop:
        """Return the loop under an input from outside, with the strip's plant as it is known."""
        return self._sharing(replace(self, forcing=Forcing(amplitude, frequency)))

    def with_gain(self, gain: float) -> Loop:
        """Return the loop with another ``gain`` [1/rad], with what is known and does not depend on it."""
        return self._sharing(replace(self, gain=gain))

    def with_reference(self, reference: float) -> Loop:
        """Return the loop with another ``reference``, with what is known and does not depend on it."""
        return self._sharing(replace(self, reference=reference))

    def _sharing(self, other: Loop) -> Loop:
        known = ("free", "netlist", "plant", "direct")
        other.__dict__.update({name: self.__dict__[name] for name in known if name in self.__dict__})
        return other


def looped(
    network: Network,
    strip: Actuator,
    gain: float,
    *,
    reference: float | None = None,
    rest_angle: float = 0.0,
    voltage: float = LARGEST_VOLTAGE,
) -> Loop:
    """Return a loop of ``network`` and ``strip``, cut into a segment for each unit.

    ``reference`` A_ref is by default the amplitude of the network's own rhythm; of a network without one the output of
    a neuron that is active alone, e/(1 + d).
    """
    require_lump(strip, "a reflex")
    count = len(network.units)
    if count > 1:
        piece = strip.geometry.free_length / count
        geometry = replace(strip.geometry, length=piece, free_length=piece, load_position=None)
        strip = replace(strip, geometry=geometry, name=f"segment of {strip.name}")
    loop = Loop(network, strip, gain, 1.0 if reference is None else reference, rest_angle, voltage)
    if reference is not None:
        return loop
    alone = float(np.abs(network.tonics).max()) / (1 + network.adaptation) or 1.0
    return loop.with_reference(loop.free.amplitude if loop.free.cycle is not None else alone)


class LoopFlow(Flow):
    """The exact flow of a `Loop`: states x, v (2 n), those of the strips, and under forcing its sine and cosine.

    Each unit's voltage switches twice, where out/A_ref + 1 and out/A_ref - 1 change sign.
    """

    def __init__(self, loop: Loop) -> None:
        network = loop.network
        super().__init__(network)
        plant = loop.plant
        n, units, order = network.size, loop.units, len(plant.b)
        self.loop, self._direct = loop, plant.direct
        self._strips = [slice(2 * n + k * order, 2 * n + (k + 1) * order) for k in range(units)]
        self.forced = loop.forcing is not None
        size = 2 * n + units * order + 2 * self.forced
        inner = [*range(2 * n), size]  # the network's own states and the 1, in the matrix of all
        linear = np.zeros((size + 1, size + 1))
        linear[np.ix_(inner, inner)] = self._linear
        outputs = np.zeros((size + 1, n))
        outputs[inner] = self._outputs
        self._into = network.readout.T / network.rise_time  # of a signal s of each unit into x (n, units)
        for k, states in enumerate(self._strips):
            linear[states, states] = plant.a
            linear[:n, states] -= loop.gain * np.outer(self._into[:, k], plant.c)
        linear[:n, -1] += loop.gain * loop.rest_angle * self._into.sum(axis=1)
        if loop.forcing is not None:
            rate = 2 * np.pi * loop.forcing.frequency
            linear[size - 2, size - 1], linear[size - 1, size - 2] = rate, -rate
            linear[:n, size - 2] += loop.forcing.amplitude * self._into.sum(axis=1)
            self.fastest = max(self.fastest, rate)
        self._linear, self._outputs = linear, outputs
        self._switches = n + 2 * units
        self._plant = plant
        self._shares = network.readout / loop.reference

    def start(self, neurons: Array) -> Array:
        """Return the state of ``neurons`` (2 n,) and strips at rest, where a forcing starts."""
        state = np.zeros(len(self._linear) - 1)
        state[: len(neurons)] = neurons
        state[-1] = 1.0 if self.forced else state[-1]
        return state

    def rate(self, state: Array) -> Array:
        z = np.append(state, 1.0)
        return np.asarray((self._full_matrix(self.values(z) > 0) @ z)[:-1])

    def _full_matrix(self, active: Active) -> Array:
        n = self.network.size
        a = self._linear.copy()
        a[:, :n] += self._outputs * active[:n]
        slopes, levels = self._voltages(active)
        for states, slope, level in zip(self._strips, slopes, levels, strict=True):
            a[states, :n] += self._plant.b[:, None] * slope
            a[states, -1] += self._plant.b * level
        if self._direct:
            felt = -self.loop.gain * self._direct * self._into
            a[:n, :n] += felt @ slopes
            a[:n, -1] += felt @ levels
        return a

    def _voltages(self, active: Active) -> tuple[Array, Array]:
        """Return the voltages of the units in a piece: their slopes by x (units, n) and their constants (units,)."""
        n = self.network.size
        above_low, above_high = active[n:].reshape(-1, 2).T.astype(float)
        slopes = (above_low - above_high)[:, None] * self._shares * active[:n]
        return self.loop.voltage * slopes, self.loop.voltage * (above_low + above_high - 1)

    def curves(self, stretch: Stretch) -> Array:
        """Return the polynomials (2 units, ORDER + 1) of the units' outputs, then of their angles [rad]."""
        terms = stretch.terms
        slopes, levels = self._voltages(stretch.active)
        angles = np.stack([self._plant.c @ terms[:, states].T for states in self._strips])
        angles += self._direct * (slopes @ terms[:, : self.network.size].T)
        angles[:, 0] += self._direct * levels
        return np.vstack([stretch.outputs(self.network.readout), angles])

    def gates(self, terms: Array, active: Active) -> Array:
        x = terms[:, : self.network.size]
        return self._switching(x, x * active[: self.network.size])

    def values(self, z: Array) -> Array:
        x = z[None, : self.network.size]
        return self._switching(x, np.maximum(x, 0))[0]

    def _switching(self, x: Array, y: Array) -> Array:
        shares = y @ self._shares.T
        n = x.shape[1]
        found = np.empty((len(x), self._switches))
        found[:, :n] = x
        found[:, n::2] = found[:, n + 1 :: 2] = shares
        ends = found[0, n:]
        ends[::2] += 1.0
        ends[1::2] -= 1.0
        ends[np.abs(ends) <= _AT_LIMIT] = 0.0
        return found

    def voltages(self, states: Array) -> Array:
        """Return the voltages [V] (t, units) at ``states`` (t, s)."""
        return self.loop.voltages(np.maximum(states[:, : self.network.size], 0) @ self.network.readout.T)

    def angles(self, states: Array) -> Array:
        """Return the angles [rad] (t, units) at ``states`` (t, s)."""
        found = np.stack([states[:, strip] @ self._plant.c for strip in self._strips], axis=1)
        return np.asarray(found + self._direct * self.voltages(states))
