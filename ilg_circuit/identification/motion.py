"""Turns a measured displacement into an observation of the coupling d(s), EC (31).

Rest position and drift are linear terms of each record. For a linear strip there is a closed form by modes, at much
lower cost than an engine. With an electrode resistance the displacement depends on the port's parameters; without one
it does not (the displacement is d(s) times the port voltage).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..drive import PiecewiseLinear
from ..errors import SolveError
from ..fit.observation import Observation
from ..fit.parameter import Parameter
from ..measurements.record import Channel
from ..measurements.voltage import MeasuredDrive
from ..simulation.response import transient_band
from ..solve.transient import DEFAULT_ACCURACY, transient
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements, lumped_port
from ..strip.port import Port
from .coupling_waves import Waves, displacements
from .modal import modal_displacement_slopes, modal_displacements, perturbed, with_slopes
from .motion_laws import EC31, LAWS, MotionLaw
from .port_model import PortModel, observed

#: The names of all laws' parameters in a fit.
NAMES = tuple(dict.fromkeys(p.name for law in LAWS.values() for p in law.parameters))
#: Largest phase [rad] of ringing of d(s) in a fit, much larger than any record shows.
_MOST_RINGING = 300.0


@dataclass(frozen=True)
class Motion:
    """A predictor of displacements of an ``actuator``, with the static or dynamic ``beam``.

    ``port`` is the electrical model that the displacement depends on, None if it does not depend on any; ``law`` is the
    one by which it bends.
    """

    actuator: Actuator
    beam: str
    engine: str
    port: PortModel | None = None
    law: MotionLaw = EC31

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*(self.port.parameters if self.port else ()), *self.law.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @property
    def linear(self) -> bool:
        """True if the displacement is linear in the voltage, so that it has a closed form."""
        return self.port.kind.linear if self.port is not None else lumped_elements(self._simplest).port.linear

    def waves(self, drive: PiecewiseLinear, t: Array) -> Waves | None:
        """Return what the displacements at ``t`` [s] are sums of, if they are: of relaxations of a known circuit."""
        if self.law.kind is None or self.port is not None or not self.linear:
            return None
        return Waves(t, drive, self._simplest, self.law.follows_charge, self.beam)

    def displacements(
        self,
        drive: PiecewiseLinear,
        t: Array,
        values: Array,
        accuracy: float | None = None,
        waves: Waves | None = None,
    ) -> Array:
        """Return displacements [m] (k, samples) at ``t`` [s] from the rest before 0, of parameters ``values`` (k, n).

        By the engine to ``accuracy``, or without one by the closed form of a linear strip, from its `waves` where they
        are given. Raises SolveError for constants that ring for longer than any record resolves.
        """
        after = t >= 0
        self._require_resolved(values[0], t)
        if waves is not None:
            return displacements(self.law, values, waves)
        strips = self._strips(values, t)
        result = np.zeros((len(values), len(t)))
        if accuracy is None:
            netlists = [strip_netlist(strip, beam=self.beam) for strip in strips]
            result[:, after] = modal_displacements(netlists, drive, t[after])
            return result
        if self.linear:
            drive = drive.from_rest()
        netlists = [strip_netlist(strip, beam=self.beam, rest=drive.rest) for strip in strips]
        found = transient(netlists, drive, t[after], engine=self.engine, accuracy=accuracy, acceptable=10 * accuracy)
        still = [steady_displacement(strip, drive.rest) for strip in strips]
        result[:, after] = found.values[:, found.names.index("displacement")] - np.array(still)[:, None]
        return result

    def slopes(self, drive: PiecewiseLinear, t: Array, values: Array) -> tuple[Array, Array] | None:
        """Return the displacement [m] (samples,) of one set (n,) in closed form, and its derivatives by logarithms.

        None where modes cancel; raises SolveError as `displacements`.
        """
        after, sets = t >= 0, perturbed(values)
        self._require_resolved(values, t)
        netlists = [strip_netlist(strip, beam=self.beam) for strip in self._strips(sets, t)]
        found = modal_displacement_slopes(netlists, drive, t[after])
        if found is None:
            return None
        prediction, each = np.zeros(len(t)), np.zeros((len(t), len(values)))
        prediction[after], each[after] = found
        return prediction, each

    def _require_resolved(self, values: Array, t: Array) -> None:
        """Raise SolveError for constants (n,) that ring for longer than any record resolves."""
        zeta, wn = values[-2:]
        if self.law == EC31 and min(wn * t[-1], 20 / max(zeta, 1e-300)) > _MOST_RINGING:
            raise SolveError("the fit of d(s) diverged beyond the resolution of the record")

    def _strips(self, values: Array, t: Array) -> list[Actuator]:
        count = len(self.law.parameters)
        couplings = [self.law.coupling(v) for v in values[:, -count:]]
        if self.port is None:
            strip = self._simplest
            return [replace(strip, coupling=c) for c in couplings]
        ladders = self.port.kind.ladders(np.array(self.port.typical), transient_band(t[t >= 0]))
        ports = [self.port.port(v, ladders) for v in values[:, :-count]]
        return [replace(strip_of(self.actuator, p), coupling=c) for p, c in zip(ports, couplings, strict=True)]

    @cached_property
    def _simplest(self) -> Actuator:
        """The strip without the parts of its circuit that do not affect the displacement."""
        full = lumped_port(self.actuator)
        if full.electrode_resistance or self.law.follows_charge:
            return self.actuator
        # straight across the source no circuit matters: a linear one has a closed form, a small one costs least
        port = Port(full.dc_resistance, ((full.dynamic_resistance, full.capacitance),))
        return Actuator.from_port(self.actuator.geometry, port, base=self.actuator.material)


@dataclass(frozen=True)
class RateOf:
    """The ``rate`` of a clock, its seconds per second of the voltage's clock, about ``pivot`` [s] since the onset.

    At the pivot times do not depend on the rate.
    """

    rate: float = 1.0
    pivot: float = 0.0

    def at_onset(self, delay: float) -> tuple[float, RateOf]:
        """Return the equivalent of ``delay`` [s] and this rate with the pivot at the onset."""
        return delay - self.pivot * (1 - 1 / self.rate), RateOf(self.rate)

    def times(self, t: Array) -> Array:
        """Return the times [s] of the voltage's clock at ``t`` [s] of this one."""
        return self.pivot + (t - self.pivot) / self.rate

    def reading(self, time: float) -> float:
        """Return what this clock reads at a ``time`` [s] of the voltage's."""
        return self.pivot + (time - self.pivot) * self.rate


@dataclass(frozen=True)
class DisplacementData:
    """The displacement of a record up to ``window`` [s] since the onset, relative to ``reference`` [m].

    ``sign`` is -1 where the camera's axis points away from the anode; with ``drift`` a slow linear one is a term of the
    fit beside the rest position. ``held`` [m/s] is a drift that is subtracted before the fit. ``share`` (-0.5 to 0.5)
    is the position of the onset in its bracket, 0 in the middle. The camera's clock is behind by ``delay`` [s], which
    is bounded by ``delays`` if it is fitted. A separate clock (``own_clock``) initially reads ``ahead`` [s] more than
    the voltage's and has the rate of ``clock``, which is fitted if the drive determines it (``tells_rate``). ``loose``
    (samples,) is the derivative of the displacement with respect to the clock's delay or rate, a linear term.
    """

    channel: Channel
    measured: MeasuredDrive
    source: str
    voltage: float
    window: float
    reference: float
    engine: str
    sign: float = 1.0
    drift: bool = False
    held: float = 0.0
    share: float = 0.0
    delay: float = 0.0
    delays: tuple[float, float] | None = None
    ahead: float = 0.0
    clock: RateOf = RateOf()
    tells_rate: bool = False
    own_clock: bool = False
    loose: Array | None = field(default=None, compare=False)

    quantity = "displacement"
    unit = "m"

    @property
    def drive(self) -> PiecewiseLinear:
        """The voltage since the onset."""
        return self.measured.moved(self.share, self.onset_width)

    @property
    def onset_width(self) -> float:
        """Width [s] of the interval of the voltage's onset between readings."""
        return float(self.measured.widths[0]) if self.own_clock else self.channel.width

    @property
    def bracketed(self) -> bool:
        """True if what all jumps have in common is known only within their brackets."""
        return bool(self.measured.stated is None and self.measured.widths.any())

    def at_share(self, share: float) -> DisplacementData:
        return replace(self, share=share)

    @property
    def places(self) -> tuple[float, ...]:
        """The places [s] of the drive's later jumps, see `MeasuredDrive`."""
        return self.measured.places

    def at_places(self, places: Array) -> DisplacementData:
        """Return the data with the drive's later jumps elsewhere in their intervals."""
        return replace(self, measured=replace(self.measured, places=tuple(places.tolist())))

    def at_delay(self, delay: float) -> DisplacementData:
        """Return the data of a camera whose clock is behind by ``delay`` [s]."""
        return replace(self, delay=delay)

    def at_rate(self, rate: float) -> DisplacementData:
        """Return the data of a camera whose clock has another ``rate``."""
        return replace(self, clock=replace(self.clock, rate=rate))

    def since(self, channel: Channel) -> Array:
        """Return the times [s] of ``channel`` since the onset, on the voltage's clock."""
        return self.clock.times(channel.since(self.share)) - self.delay

    @property
    def late(self) -> float:
        """Delay [s] of the displacement's clock at the onset."""
        return self.ahead + self.clock.reading(self.delay) - (self.share * self.onset_width if self.own_clock else 0.0)

    @property
    def part(self) -> Channel:
        """The samples up to the window."""
        return self.channel.until(self.window)

    @property
    def abscissa(self) -> Array:
        return self.part.time

    @property
    def data(self) -> Array:
        return self.part.values - self.reference - self.held * self.abscissa

    @property
    def size(self) -> float:
        """The span of the readings [m]."""
        return float(np.ptp(self.part.values))

    def shown(self, numbers: Array) -> Array:
        return numbers + self.reference + self.held * self.abscissa

    @property
    def nuisance(self) -> Array:
        """Linear terms (samples, 1 to 3): rest position, drift, ``loose``."""
        t = self.abscissa
        known = np.column_stack([np.ones(len(t)), t])[:, : 1 + self.drift]
        return known if self.loose is None else np.column_stack([known, self.loose])

    def observation(
        self,
        motion: Motion,
        sigma: float | Array = 1.0,
        *,
        of_record: bool = False,
        accuracy: float = DEFAULT_ACCURACY,
    ) -> Observation:
        """Return the observation predicted by ``motion``: by the closed form of a linear strip, else by the engine.

        The prediction ``of_record`` is made by the chosen engine.
        """
        t, drive = self.since(self.part), self.drive
        closed = motion.linear and not (of_record and self.engine != "exact")
        waves = motion.waves(drive, t) if closed else None

        def predict(values: Array) -> Array:
            return self.sign * motion.displacements(drive, t, values, None if closed else accuracy, waves)

        def slopes(values: Array) -> tuple[Array, Array] | None:
            found = motion.slopes(drive, t, values)
            return found and (self.sign * found[0], self.sign * found[1])

        known = with_slopes(predict, slopes) if closed and waves is None else predict
        return observed(self, motion.names, known, self.nuisance, sigma)


def steady_displacement(strip: Actuator, voltage: float) -> float:
    """Return the displacement [m] of a strip at rest under ``voltage`` [V]."""
    return lumped_elements(strip).steady(voltage)


def strip_of(actuator: Actuator, port: Port) -> Actuator:
    """Return the actuator with another port; a ladder keeps its band and number of sections."""
    strip = Actuator.from_port(actuator.geometry, port, base=actuator.material)
    if port.ladder is not None:
        low, high = port.ladder.band
        sections = float(len(port.ladder.sections))
        material = replace(strip.material, ladder_lowest=low, ladder_highest=high, ladder_sections=sections)
        strip = replace(strip, material=material)
    return replace(strip, coupling=actuator.coupling, mounting=actuator.mounting, name=actuator.name)


def port_matters(actuator: Actuator, port: PortModel) -> bool:
    """Return True if the displacement depends on the port's parameters: if there is an electrode resistance."""
    return port.held is None or lumped_port(actuator).electrode_resistance > 0
