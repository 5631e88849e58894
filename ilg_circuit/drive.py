"""Drives: the voltage (or current, or motion) over time that a source imposes on the strip, by lines or as a sine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Array
from .errors import InputError
from .findings import Finding
from .units import format_quantity, require_plausible

if TYPE_CHECKING:
    from typing import Self

#: Rise time [s] of a jump in a netlist handed out; plain SPICE engines need one.
NETLIST_RISE = 1e-6

#: Times that differ by less than this fraction are equal up to rounding.
ON_EDGE = 1e-12


class Drive(Protocol):
    """A voltage [V] (or a current [A], a motion [m]) over time from t = 0 on; on a jump its value is the right limit.

    A drive by current has the ``unit`` "A", see `by_current`.
    """

    def __hash__(self) -> int: ...

    @property
    def rest(self) -> float:
        """Level [V] before t = 0, under which the circuit has come to rest."""

    @property
    def text(self) -> str:
        """Name the drive in a few words, with units."""

    def value(self, t: ArrayLike) -> Array:
        """Return the voltage [V] at times ``t`` [s] >= 0."""

    def breakpoints(self, duration: float) -> Array:
        """Return the times [s] in (0, duration) at which value or slope jumps, ascending."""

    def jumps(self, duration: float) -> Array:
        """Return the breakpoints at which the value jumps."""

    def angular_frequency(self) -> float:
        """Return the highest angular frequency [rad/s] of the smooth parts; 0 for straight lines."""

    def largest(self) -> float:
        """Return the largest absolute value [V]."""

    def spice(self, duration: float) -> str:
        """Return the waveform of a SPICE voltage source over ``duration`` [s]: PWL(...) or SIN(...)."""


@dataclass(frozen=True)
class Sine:
    """The drive amplitude sin(2 pi f t) [V], f in Hz; InputError unless f > 0. ``unit`` and ``limit``: `by_current`."""

    amplitude: float
    frequency: float
    unit: str = "V"
    limit: float | None = None

    rest = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.amplitude) and np.isfinite(self.frequency) and self.frequency > 0):
            raise InputError(
                f"sine of {self.amplitude:g} {self.unit}, {self.frequency:g} Hz: the frequency must be more than zero"
            )
        require_plausible("sine, frequency", self.frequency, "Hz")

    @property
    def text(self) -> str:
        return f"sine {format_quantity(self.amplitude, self.unit, 6)}, {format_quantity(self.frequency, 'Hz', 6)}"

    def value(self, t: ArrayLike) -> Array:
        return np.asarray(self.amplitude * np.sin(self.angular_frequency() * np.asarray(t, dtype=float)))

    def breakpoints(self, duration: float) -> Array:
        return np.empty(0)

    jumps = breakpoints

    def angular_frequency(self) -> float:
        return 2 * np.pi * self.frequency

    def largest(self) -> float:
        return abs(self.amplitude)

    def spice(self, duration: float) -> str:
        return f"SIN(0.0 {float(self.amplitude)!r} {float(self.frequency)!r})"


@dataclass(frozen=True, eq=False)
class PiecewiseLinear:
    """Straight lines through (times, values); a time that stands twice is a jump; held before and after.

    ``times`` [s] do not decrease; ``values`` [V], same length; before t = 0 the circuit has come to rest under the
    level ``rest`` [V]. Raises InputError otherwise. ``findings`` say what a run makes of a file that holds another time
    than it. ``unit``, ``limit``: see `by_current`.
    """

    times: Array
    values: Array
    text: str = "waveform"
    rest: float = 0.0
    findings: tuple[Finding, ...] = ()
    unit: str = "V"
    limit: float | None = None

    def __post_init__(self) -> None:
        times, values = np.asarray(self.times, dtype=float), np.asarray(self.values, dtype=float)
        if times.ndim != 1 or times.shape != values.shape or not len(times):
            raise InputError("a waveform needs as many times as values, at least one")
        if not (np.isfinite(times).all() and np.isfinite(values).all() and np.isfinite(self.rest)):
            raise InputError("a waveform must be finite numbers")
        if (np.diff(times) < 0).any():
            raise InputError("the times of a waveform must not decrease")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)

    @classmethod
    def step(cls, voltage: float, at: float = 0.0, unit: str = "V") -> Self:
        """Return 0 V before ``at`` [s] and ``voltage`` [V] from then on."""
        text = f"step {format_quantity(voltage, unit, 6)}"
        if at == 0:
            return cls(np.array([0.0]), np.array([voltage]), text, unit=unit)
        return cls(np.array([at, at]), np.array([0.0, voltage]), text, unit=unit)

    @classmethod
    def ramp(cls, rate: float, duration: float, unit: str = "V") -> Self:
        """Return a rise from 0 V at ``rate`` [V/s] for ``duration`` [s], then held."""
        return cls(np.array([0.0, duration]), np.array([0.0, rate * duration]), f"ramp {rate:g} {unit}/s", unit=unit)

    @classmethod
    def square(
        cls, low: float, high: float, period: float, duration: float, duty: float = 0.5, unit: str = "V"
    ) -> Self:
        """Return ``high`` for the part ``duty`` of each ``period`` [s], then ``low`` [V], from t = 0.

        Raises
        ------
        InputError
            The period is not positive, the duty not in (0, 1), or there are more than a million periods.
        """
        if not period > 0:
            raise InputError(f"square wave: period {period:g} s must be more than zero")
        if not 0 < duty < 1:
            raise InputError(f"square wave: duty {duty:g} must lie between 0 and 1")
        if duration / period > 1_000_000:
            raise InputError(
                f"square wave: {duration / period:.3g} periods are more than 1000000; shorten the duration"
            )
        count = int(duration / period * (1 + ON_EDGE)) + 1
        starts = np.arange(count) * period
        edges = np.column_stack([starts, starts + duty * period]).ravel()
        levels = np.tile([high, low], count)
        times = np.repeat(edges, 2)[1:]
        values = np.repeat(levels, 2)[:-1]
        text = f"square {low:g} {unit}..{high:g} {unit}, {format_quantity(period, 's', 6)}, duty {duty:g}"
        return cls(times, values, text, unit=unit)

    def resting(self, rest: float) -> PiecewiseLinear:
        """Return the drive with the level ``rest`` [V] before it."""
        return replace(self, rest=rest)

    def from_rest(self) -> PiecewiseLinear:
        """Return the same changes of the level, from a rest at zero; each time the same drive."""
        return self._from_rest if self.rest else self

    @cached_property
    def _from_rest(self) -> PiecewiseLinear:
        return replace(self, values=self.values - self.rest, rest=0.0)

    def value(self, t: ArrayLike) -> Array:
        time = np.asarray(t, dtype=float)
        # a time that misses an edge by rounding is on it
        after = np.searchsorted(self.times, time + ON_EDGE * np.abs(time), side="right")
        left, right = np.clip(after - 1, 0, None), np.clip(after, None, len(self.times) - 1)
        span = self.times[right] - self.times[left]
        fraction = np.where(span > 0, (time - self.times[left]) / np.where(span > 0, span, 1), 0.0)
        return np.asarray(self.values[left] + np.clip(fraction, 0, 1) * (self.values[right] - self.values[left]))

    def breakpoints(self, duration: float) -> Array:
        return np.unique(self.times[(self.times > 0) & (self.times < duration)])

    def jumps(self, duration: float) -> Array:
        twice = self.times[1:][np.diff(self.times) == 0]
        return np.unique(twice[(twice > 0) & (twice < duration)])

    def angular_frequency(self) -> float:
        return 0.0

    def largest(self) -> float:
        return float(np.abs(self.values).max())

    def spice(self, duration: float) -> str:
        times, values = self.widened(duration, NETLIST_RISE)
        return "PWL(" + " ".join(f"{t!r} {v!r}" for t, v in zip(times.tolist(), values.tolist(), strict=True)) + ")"

    def widened(self, duration: float, rise: float) -> tuple[Array, Array]:
        """Return ascending times and values from 0 to past ``duration``, each jump a ramp of ``rise`` [s] about it."""
        inside = (self.times > 0) & (self.times < duration)
        times = np.concatenate([[0.0], self.times[inside], [2 * duration]])
        values = np.concatenate([self.value([0.0]), self.values[inside], [0.0]])
        same = np.diff(times) == 0
        between = np.append(np.append(False, same[:-1] & same[1:]), False)
        times, values = times[~between], values[~between]  # of several at one time the first and the last count
        gaps = np.diff(times)
        jump = np.flatnonzero(gaps == 0)
        # a jump may not reach its neighbours, however near they are
        room = np.minimum(gaps[jump - 1], gaps[np.minimum(jump + 1, len(gaps) - 1)])
        half = np.minimum(rise / 2, room / 4)
        shifted = times.copy()
        shifted[jump] -= half
        shifted[jump + 1] += half
        # the last point lies beyond the run, on the line that the run ends on
        before = values[-2]
        slope = self._slope_after(times[-2], duration)
        values[-1] = before + slope * (shifted[-1] - shifted[-2])
        return shifted, values

    def _slope_after(self, t: float, duration: float) -> float:
        """Return the slope of the line that the run ends on; its middle is not touched by a jump at the end."""
        later = self.times[self.times > t]
        if not len(later) or duration <= t:
            return 0.0
        start, middle = self.value([t, (t + duration) / 2])
        return float(2 * (middle - start) / (duration - t))


@dataclass(frozen=True, eq=False)
class Drives:
    """Several drives at once, each of a source of its own: ``named`` is (name, drive), the first one first.

    All start from rest at zero; the values are (drives, times).
    """

    named: tuple[tuple[str, Drive], ...]

    rest = 0.0

    def __post_init__(self) -> None:
        if not self.named or any(drive.rest for drive in self.parts):
            raise InputError("several drives need one at least, and all start from 0 V")
        if currents := [name for name, drive in self.named if by_current(drive)]:
            raise InputError(f"segment {currents[0]} is driven by a current; segments are driven by voltages")

    @property
    def parts(self) -> tuple[Drive, ...]:
        return tuple(drive for _, drive in self.named)

    @property
    def text(self) -> str:
        return "; ".join(f"{name} = {drive.text}" for name, drive in self.named)

    @property
    def findings(self) -> tuple[Finding, ...]:
        return tuple(finding for drive in self.parts for finding in drive_findings(drive))

    def value(self, t: ArrayLike) -> Array:
        return np.stack([drive.value(t) for drive in self.parts])

    def breakpoints(self, duration: float) -> Array:
        return np.unique(np.concatenate([drive.breakpoints(duration) for drive in self.parts]))

    def jumps(self, duration: float) -> Array:
        return np.unique(np.concatenate([drive.jumps(duration) for drive in self.parts]))

    def angular_frequency(self) -> float:
        return max(drive.angular_frequency() for drive in self.parts)

    def largest(self) -> float:
        return max(drive.largest() for drive in self.parts)

    def spice(self, duration: float) -> str:
        """Return the waveform of the first source."""
        return self.parts[0].spice(duration)


def each(drive: Drive) -> tuple[Drive, ...]:
    """Return the drives of all sources, one for a drive that is of one."""
    return drive.parts if isinstance(drive, Drives) else (drive,)


def levels(drive: Drive, t: ArrayLike) -> Array:
    """Return the voltages [V] of all sources at times ``t`` [s]; shape (sources, times)."""
    return np.stack([part.value(t) for part in each(drive)])


def by_current(drive: Drive) -> bool:
    """Return True for a drive whose values are a current [A] that a source forces through the strip."""
    return getattr(drive, "unit", "V") == "A"


def voltage_limit(drive: Drive) -> float | None:
    """Return the voltage [V] beyond which a source of current gives way, its compliance; None without a limit."""
    return getattr(drive, "limit", None) if by_current(drive) else None


def require_voltage(drive: Drive, what: str) -> Drive:
    """Return the drive. Raises InputError for a drive by current, which ``what`` does not take."""
    if by_current(drive):
        raise InputError(f"{what} takes a voltage, not the current '{drive.text}'; simulate takes both")
    return drive


def drive_findings(drive: Drive) -> tuple[Finding, ...]:
    """Return the findings on a drive, none for a drive without findings."""
    return tuple(getattr(drive, "findings", ()))


def drive_times(drive: Drive, times: Array) -> Array:
    """Return ``times`` (n,) [s], those that miss an edge of the drive by rounding moved onto it (its right limit)."""
    edges = drive.breakpoints(float(times[-1]) * (1 + ON_EDGE)) if len(times) else times
    if not len(edges):
        return times
    after = np.searchsorted(edges, times)
    for nearest in (after - 1, after):
        edge = edges[np.clip(nearest, 0, len(edges) - 1)]
        times = np.where(np.abs(times - edge) <= ON_EDGE * edge, edge, times)
    return times
