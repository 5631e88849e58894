"""Rows of times [s] and values of named waveforms, for a run of some duration: what straight lines draw.

Curved ones are drawn by `LINES` lines or more in each period, so that they lie within 8e-5 of their amplitude.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..errors import InputError

#: Number of lines that approximate a curve in its shortest period.
LINES = 256
_MOST_ROWS = 1_000_000
_MOST_TONES = 1000
#: Number of random sets of phases from which a multisine takes the best.
_PHASES = 40

Rows = tuple[Array, Array]


def triangle(low: float, high: float, period: float, duration: float, cycles: float = np.inf) -> Rows:
    """Return straight lines between ``low`` and ``high``, rising first, from zero where it lies between them.

    After the given number of ``cycles`` the level returns to the initial one.
    """
    _require(low < high, f"triangle from {low:g} to {high:g}: give the lower level first")
    _require(period > 0, f"period {period:g} s must be more than zero")
    _require(cycles > 0, f"{cycles:g} cycles: give one or more")
    begin = min(max(0.0, low), high)
    count = min(cycles, np.ceil(duration / period) + 1)
    _require(count * 2 < _MOST_ROWS, f"{duration / period:.3g} periods are too many; shorten the duration")
    rise = (high - begin) / (high - low) / 2
    corners = np.array([0.0, rise, rise + 0.5])
    times = (np.arange(int(count))[:, None] + corners).ravel() * period
    values = np.tile([begin, high, low], int(count))
    return np.append(times, count * period), np.append(values, begin)


def pulses(level: float, width: float, period: float, duration: float, count: float = np.inf) -> Rows:
    """Return ``level`` for ``width`` [s] in each ``period`` [s], zero between, ``count`` times."""
    _require(
        0 < width < period, f"pulses of {width:g} s every {period:g} s: the width must lie between 0 and the period"
    )
    _require(count >= 1, f"{count:g} pulses: give one or more")
    number = min(count, np.ceil(duration / period) + 1)
    _require(number * 4 < _MOST_ROWS, f"{duration / period:.3g} pulses are too many; shorten the duration")
    starts = np.arange(int(number)) * period
    edges = np.column_stack([starts, starts + width]).ravel()
    return np.repeat(edges, 2)[1:], np.repeat(np.tile([level, 0.0], int(number)), 2)[:-1]


def chirp(amplitude: float, low: float, high: float, duration: float) -> Rows:
    """Return a sine whose frequency goes from ``low`` to ``high`` [Hz] over ``duration`` [s], each decade as long."""
    _require(0 < low < high, f"chirp from {low:g} Hz to {high:g} Hz: give two frequencies above zero, the lower first")
    rate = np.log(high / low) / duration
    # as many steps in the shortest period of each stretch over which the frequency doubles
    ends = np.minimum(np.log(2) / rate * np.arange(int(np.ceil(np.log2(high / low))) + 1), duration)
    rows = [np.array([0.0])]
    for k, (start, stop) in enumerate(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)):
        lines = np.ceil((stop - start) * min(low * 2 ** (k + 1), high) * LINES)
        _require(lines < _MOST_ROWS, _too_many(high, duration))
        rows.append(np.linspace(start, stop, int(lines) + 1)[1:])
    times = np.concatenate(rows)
    _require(len(times) < _MOST_ROWS, _too_many(high, duration))
    return times, amplitude * np.sin(2 * np.pi * low / rate * np.expm1(rate * times))


def sampled(value: Callable[[Array], Array], angular_frequency: float, duration: float) -> Rows:
    """Return the rows of a curve of one ``angular_frequency`` [rad/s] over ``duration`` [s]."""
    lines = np.ceil(duration * angular_frequency / (2 * np.pi) * LINES)
    _require(lines < _MOST_ROWS, _too_many(angular_frequency / (2 * np.pi), duration))
    times = np.linspace(0.0, duration, max(int(lines), 1) + 1)
    return times, value(times)


def multisine(peak: float, low: float, high: float, duration: float, tones: int = 10) -> Rows:
    """Return a sum of ``tones`` sines between ``low`` and ``high`` [Hz], about even in logarithm, of equal amplitude.

    They are harmonics of ``low``, so that the sum has its period, and it reaches ``peak``. Their phases are those, of
    sets drawn with one seed, of the lowest peak for the same power.
    """
    _require(
        0 < low < high, f"multisine from {low:g} Hz to {high:g} Hz: give two frequencies above zero, the lower first"
    )
    _require(2 <= tones <= _MOST_TONES, f"{tones} tones: give 2 to {_MOST_TONES}")
    harmonics = np.unique(np.geomspace(1, np.floor(high / low * (1 + 1e-9)), tones).round())
    count = np.ceil(duration * low * harmonics[-1] * LINES)
    _require(count < _MOST_ROWS, _too_many(high, duration))

    def added(times: Array, phases: Array) -> Array:
        return np.asarray(sum(np.sin(2 * np.pi * low * h * times + p) for h, p in zip(harmonics, phases, strict=True)))

    def highest(phases: Array, lines: int) -> float:
        whole = np.linspace(0, 1 / low, int(harmonics[-1]) * lines + 1)
        return float(np.abs(added(whole, phases)).max())

    drawn = np.random.default_rng(0).uniform(0, 2 * np.pi, (_PHASES, len(harmonics)))
    best = min(drawn, key=lambda phases: highest(phases, 16))
    times = np.linspace(0, duration, int(count) + 1)
    return times, added(times, best) * peak / highest(best, LINES)


def repeated(times: Array, values: Array, count: int) -> Rows:
    """Return the rows ``count`` times, one after the other; the end of one is the beginning of the next."""
    _require(count >= 1, f"{count} times: give one or more")
    _require(count * len(times) < _MOST_ROWS, f"{count} times {len(times)} rows are too many")
    span = times[-1] - times[0]
    _require(span > 0, "a file with one row cannot be repeated")
    starts = np.repeat(np.arange(count) * span, len(times))
    return np.tile(times, count) + starts, np.tile(values, count)


def _too_many(frequency: float, duration: float) -> str:
    return f"{frequency:g} Hz over {duration:g} s takes more than {_MOST_ROWS} lines; shorten it or lower the frequency"


def _require(holds: object, message: str) -> None:
    if not holds:
        raise InputError(message)
