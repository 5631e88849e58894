"""A PI law as a circuit to build: operational amplifiers, resistors and capacitors of the E series, its parts list.

U1 takes the reference from the sensor's voltage. U2 is the PI: R5 in, R6 and C1 in series as feedback, so that
gain = R6/R5 and reset time = R6 C1. Two dividers with diodes take over U2's feedback at the limit. C1 then follows the
limited output through R6, which is back-calculation with the reset time. U3 gives the strip its current. A weight of
the reference below one is a lag before U1: (1 + weight Ti s)/(1 + Ti s).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import InputError, argument
from ..units import format_quantity
from .laws import Law

#: Values of a decade.
E24 = (1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0, 3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5,
       8.2, 9.1)  # fmt: skip
E12 = (1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3, 3.9, 4.7, 5.6, 6.8, 8.2)
#: Resistors [ohm] and capacitors [F], which are films, that are chosen among.
RESISTORS = np.array([float(f"{v}e{d}") for d in (3, 4, 5, 6) for v in E24])
CAPACITORS = np.array([*(float(f"{v}e{d}") for d in (-9, -8, -7, -6) for v in E12), 1e-5])
#: Resistors of the limit: small ones make it sharp, but load U2.
_SHARP = RESISTORS[(RESISTORS >= 2e3) & (RESISTORS < 1e4)]
#: An amplifier's output stays this far from its supply [V].
HEADROOM = 1.5
#: Largest relative deviation of gain, reset time or weight with which a circuit is still given.
MOST_OFF = 0.05
#: A 1N4148: saturation current [A], and emission coefficient times thermal voltage at 27 degC [V].
_SATURATION, _EMISSION = 2.52e-9, 1.752
_SLOPE = _EMISSION * 1.380649e-23 * 300.15 / 1.602176634e-19
#: Resistance [ohm] of the four resistors that make a difference.
_EQUAL = 1e5


@dataclass(frozen=True)
class OpAmps:
    """What the circuit is made with: gain-bandwidth [Hz] and supply [V] of its amplifiers, the sensor's gain [V/m]."""

    gain_bandwidth: float = 1e6
    supply: float = 15.0
    sensor_gain: float = 1e3
    open_loop_gain: float = 1e5

    @property
    def rail(self) -> float:
        """Largest voltage that an amplifier gives [V]."""
        return self.supply - HEADROOM


@dataclass(frozen=True)
class Part:
    """A part of the circuit: designator, nodes, value [ohm or F] or None, its text, purpose."""

    designator: str
    nodes: tuple[str, ...]
    value: float | None
    text: str
    purpose: str


@dataclass(frozen=True)
class Controller:
    """A PI controller as a circuit: its parts, and the law that they make.

    ``gain`` [V/m], ``reset_time`` [s], ``weight`` and ``limit`` [V] are those of the parts, and ``asked`` the ones
    that were asked for, in this order. ``lag`` [s] is the time constant that makes the weight; it should be the reset
    time. The limit holds for an error as large as the whole range of the reference.
    """

    op_amps: OpAmps
    parts: tuple[Part, ...]
    gain: float
    reset_time: float
    weight: float
    limit: float
    lag: float
    asked: tuple[float, float, float, float]

    @property
    def deviations(self) -> dict[str, float]:
        """Relative deviations of what was asked for, and of the lag from the reset time."""
        found = (self.gain, self.reset_time, self.weight, self.limit)
        names = ("gain", "reset_time", "weight", "limit")
        off = {n: v / a - 1 if a else 0.0 for n, v, a in zip(names, found, self.asked, strict=True)}
        return {**off, "lag": self.lag / self.reset_time - 1}

    def table(self) -> dict[str, list[str]]:
        """Return the parts list: designator, value, purpose."""
        return {
            "designator": [part.designator for part in self.parts],
            "value": [part.text for part in self.parts],
            "purpose": [part.purpose for part in self.parts],
        }

    def to_dict(self) -> dict[str, Any]:
        """Return gains, their deviations and the parts list as plain data."""
        table = self.table()
        return {
            **vars(self.op_amps),
            "gain": self.gain,
            "reset_time": self.reset_time,
            "weight": self.weight,
            "limit": self.limit,
            "lag": self.lag,
            "deviations": self.deviations,
            "parts": [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)],
        }

    def lines(self, drive: str) -> list[str]:
        """Return the circuit from ``reference`` and ``sensed`` to the node ``drive``, with its models."""
        made = self.op_amps
        farads = 1e-3 / (2 * np.pi * made.gain_bandwidth)
        body = []
        for part in self.parts:
            kind = part.designator[0]
            value = {"U": "op_amp", "D": "signal"}.get(kind, f"{part.value!r}{' ic=0' if kind == 'C' else ''}")
            body.append(f"{'X' if kind == 'U' else ''}{part.designator} {' '.join(part.nodes)} {value}")
        return [
            f"Xcontroller reference sensed {drive} vplus vminus controller",
            f"Vplus vplus 0 {made.supply!r}",
            f"Vminus vminus 0 {-made.supply!r}",
            ".subckt controller reference sensed drive vplus vminus",
            *body,
            ".ends controller",
            "* an amplifier of one pole, which recovers at once from its rails",
            ".subckt op_amp positive negative out",
            "Gstage 0 stage positive negative 1m",
            f"Rstage stage 0 {made.open_loop_gain / 1e-3!r}",
            f"Cstage stage 0 {float(farads)!r} ic=0",
            f"Vhigh high 0 {made.rail - 0.05!r}",
            f"Vlow low 0 {0.05 - made.rail!r}",
            "Dhigh stage high limiter",
            "Dlow low stage limiter",
            "Eout out 0 stage 0 1",
            ".ends op_amp",
            ".model limiter D(is=1e-12 n=0.08)",
            f".model signal D(is={_SATURATION!r} n={_EMISSION!r})",
        ]


def op_amp_controller(law: Law, limit: float, jump: float, made: OpAmps) -> Controller:
    """Return the circuit of a PI law whose output stays within ``limit`` [V], for errors to ``jump`` [m].

    Resistors are of E24, C of E12, the nearest to gain and reset time. Raises InputError for a law or voltages that
    such a circuit does not make.
    """
    gain, reset, weight = wanted = _asked(law)
    _require(made, limit, jump)
    volts = gain / made.sensor_gain
    into, feedback, hold = nearest(lambda a, b, c: (b / a, b * c), (volts, reset), f"gain {volts:g} V/V", made)
    upper, lower, reached = _limit(limit, made.supply, made.sensor_gain * jump / into)
    parts, following, lag = [], "reference", feedback * hold  # as long as the reset time that the parts make
    if weight < 1:
        following = "followed"
        first, second, slow = 0.0, 0.0, 0.0
        if weight:
            first, second, slow = nearest(
                lambda a, b, c: (b / (a + b), (a + b) * c), (weight, lag), f"weight {weight:g}", made
            )
        else:
            first, _, slow = nearest(lambda a, b, c: (1 + 0 * b, a * c), (1.0, lag), "weight 0", made)
        low = "lagged" if weight else "slow"
        parts = [
            _resistor(11, ("reference", "slow"), first, "lag of the reference, (1 - weight) of the reset time"),
            *([_resistor(12, ("slow", "lagged"), second, "lag of the reference, weight")] if weight else []),
            _capacitor(2, (low, "0"), slow, "lag of the reference"),
            Part("U4", ("slow", "followed", "followed"), None, _amplifier(made), "follower of the lagged reference"),
        ]
        weight, lag = second / (first + second), (first + second) * slow
    parts = [
        _resistor(1, ("sensed", "plus"), _EQUAL, "difference: sensor in"),
        _resistor(2, ("plus", "0"), _EQUAL, "difference: to ground"),
        _resistor(3, (following, "minus"), _EQUAL, "difference: reference in"),
        _resistor(4, ("minus", "error"), _EQUAL, "difference: feedback"),
        Part("U1", ("plus", "minus", "error"), None, _amplifier(made), "difference, sensor less reference"),
        _resistor(5, ("error", "sum"), into, "PI: input, gain = R6/R5"),
        _resistor(6, ("asked", "held"), feedback, "PI: feedback, reset time = R6 C1"),
        _capacitor(1, ("held", "sum"), hold, "PI: integral"),
        Part("U2", ("0", "sum", "asked"), None, _amplifier(made), "PI, inverting"),
        _resistor(7, ("asked", "high"), upper, "upper limit: from the output"),
        _resistor(8, ("high", "vminus"), lower, "upper limit: from the negative supply"),
        Part("D1", ("high", "sum"), None, "1N4148", "upper limit and anti-windup"),
        _resistor(9, ("asked", "low"), upper, "lower limit: from the output"),
        _resistor(10, ("low", "vplus"), lower, "lower limit: from the positive supply"),
        Part("D2", ("sum", "low"), None, "1N4148", "lower limit and anti-windup"),
        Part("U3", ("asked", "drive", "drive"), None, _amplifier(made, "power "), "follower that drives the strip"),
        *parts,
    ]
    return Controller(
        made,
        tuple(parts),
        gain=made.sensor_gain * feedback / into,
        reset_time=feedback * hold,
        weight=weight,
        limit=reached,
        lag=lag,
        asked=(*wanted, limit),
    )


def nearest(
    makes: Callable[[Array, Array, Array], tuple[Array, Array]],
    asked: tuple[float, float],
    what: str,
    made: OpAmps,
) -> tuple[float, float, float]:
    """Return the two resistors [ohm] and the capacitor [F] that make two quantities nearest to those ``asked`` for.

    Nearest is the least sum of squares of both relative deviations; among equal ones the largest capacitor, as small
    resistors mind the amplifier's and the diodes' currents least. Raises InputError where one is off by more than 5 %.
    """
    first, second, capacitor = np.meshgrid(RESISTORS, RESISTORS, CAPACITORS, indexing="ij", sparse=True)
    with np.errstate(all="ignore"):  # of values that no parts come near
        off = np.broadcast_arrays(*(v / a - 1 for v, a in zip(makes(first, second, capacitor), asked, strict=True)))
        squares = np.nan_to_num(off[0] ** 2 + off[1] ** 2, nan=np.inf)
    best = np.argwhere(squares <= squares.min() + 1e-12)
    i, j, k = best[np.lexsort((best[:, 0], best[:, 2]))[-1]]
    if not all(abs(float(o[i, j, k])) <= MOST_OFF for o in off):
        raise InputError(
            f"no resistors of 1 kohm to 9.1 Mohm and capacitors of 1 nF to 10 uF make {what} "
            f"with a time of {asked[1]:g} s; change the controller or {argument('sensor_gain')} "
            f"{made.sensor_gain / 1e3:g} V/mm"
        )
    return float(RESISTORS[i]), float(RESISTORS[j]), float(CAPACITORS[k])


def _limit(limit: float, supply: float, current: float) -> tuple[float, float, float]:
    """Return the divider [ohm] of the limit, and the voltage [V] at which U2 stops while ``current`` [A] flows in.

    It is the largest that does not exceed ``limit``.
    """
    drop = _SLOPE * np.log(1 + current / _SATURATION)
    upper, lower = np.meshgrid(_SHARP, RESISTORS, indexing="ij")
    stops = drop + upper * (current + (drop + supply) / lower)
    stops[stops > limit] = -np.inf
    i, j = np.unravel_index(int(np.argmax(stops)), stops.shape)
    if not stops[i, j] >= (1 - MOST_OFF) * limit:
        raise InputError(
            f"the diodes cannot limit the output to {limit:g} V; they need 0.5 V or more, "
            f"so take another limit or {argument('supply')}"
        )
    return float(_SHARP[i]), float(RESISTORS[j]), float(stops[i, j])


def _asked(law: Law) -> tuple[float, float, float]:
    """Return gain [V/m], reset time [s] and weight of a law. Raises InputError for one that is no such circuit."""
    form = argument("form", "op-amps")
    gain, rate = -law.measured, float(law.into_reference[0]) if len(law.out) == 1 else 0.0
    integrates = len(law.out) == 1 and law.a[0, 0] == 0 and law.out[0] == 1 and law.into_measured[0] == -rate
    if law.kind != "pi":
        raise InputError(f"{form} is for a controller of kind pi, not {law.kind}; tune one with kind pi")
    if not (integrates and 0 < gain < np.inf and 0 < rate < np.inf):
        raise InputError(f"{form} needs a pi whose gain and reset time are more than zero, and one integral of r - y")
    reset, weight = gain / rate, law.reference / gain
    if law.clamps or not np.isclose(law.into_excess[0] * reset, 1.0, rtol=1e-9, atol=0):
        raise InputError(f"{form} has back-calculation with the reset time; tune without another anti-windup")
    if not 0 <= weight <= 1:
        raise InputError(f"{form} has a weight of 0 to 1, not {weight:g}")
    return gain, reset, weight


def _require(made: OpAmps, limit: float, jump: float) -> None:
    """Raise InputError for values that no amplifier has, and voltages beyond its rails."""
    for name, value, unit, least, most in (
        ("gain_bandwidth", made.gain_bandwidth, "Hz", 1e3, 1e9),
        ("supply", made.supply, "V", 3.0, 100.0),
        ("sensor_gain", made.sensor_gain, "V/m", 1.0, 1e6),
    ):
        if not (np.isfinite(value) and least <= value <= most):
            raise InputError(f"{argument(name)} is {value:g} {unit}; it must be {least:g} to {most:g} {unit}")
    for what, volts in (
        ("the limit", limit),
        ("the range of the reference, as the sensor gives it,", made.sensor_gain * jump),
    ):
        if volts > made.rail:
            raise InputError(
                f"{what} is {volts:g} V; with {argument('supply')} {made.supply:g} V an amplifier gives "
                f"{made.rail:g} V at most"
            )


def _resistor(number: int, nodes: Sequence[str], value: float, purpose: str) -> Part:
    return Part(f"R{number}", tuple(nodes), value, format_quantity(value, "ohm", 3), purpose)


def _capacitor(number: int, nodes: Sequence[str], value: float, purpose: str) -> Part:
    return Part(f"C{number}", tuple(nodes), value, f"{format_quantity(value, 'F', 3)} film", purpose)


def _amplifier(made: OpAmps, kind: str = "") -> str:
    return f"{kind}op-amp, {format_quantity(made.gain_bandwidth, 'Hz', 3)}, +-{made.supply:g} V"
