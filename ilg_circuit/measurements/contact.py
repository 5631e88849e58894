"""Contact lost while a record was taken: when the current did what no passive strip does and read that of an open clamp.

Under a voltage that jumps, a strip's current jumps; under one that does not, it cannot. A current that is cut off to
zero, that comes back from zero, or that stays at zero while the voltage jumps, against what a passive port fitted to
the record does there, is that of an open circuit. What the strip holds when contact comes back is not known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Mask
from .onset import Onset, voltage_jumps
from .passive import PassivePort
from .smoothing import noise_level, resolution

#: Readings within so many noise levels of an open clamp's may be its readings.
_BAND = 5.0
#: An edge of the current is so many standard errors, and this part of the largest current.
_SURE, _LEAST = 7.0, 0.005
#: An edge of the current that the voltage explains to this part is the strip's.
_EXPLAINED = 0.5
#: A break has so many readings at least: fewer are outliers.
_FEWEST = 3
#: Numbers of readings on either side of an edge by which it is told from noise.
_WINDOWS = (1, 3, 8, 20, 50, 120)
#: Exact zeros in a row, where the instrument's resolution is so much finer than its noise, are no readings of a strip.
_ZEROS, _FINE = 6, 0.3
#: What the fit's misfit is allowed to feign, in its rms.
_OF_MISFIT = 3.0
#: The likelihood of a beginning falls by so much to the last one that is plausible.
_PLAUSIBLE = 6.0
_ROUNDS = 4


@dataclass(frozen=True)
class Break:
    """Contact was lost after the reading ``last`` and came back with the reading ``back``, None if never.

    The break may have begun after the reading ``earliest`` already: later ones do not tell.
    """

    earliest: int
    last: int
    back: int | None


@dataclass(frozen=True)
class Seen:
    """Readings with both voltage and current: times [s], voltage [V] and current [A], all (n,), and the onset's row.

    ``open_at`` [A] are the levels that an open clamp may read, ``noise`` [A] of the current.
    """

    t: Array
    u: Array
    i: Array
    first: int
    open_at: tuple[float, ...]
    noise: float

    @property
    def largest(self) -> float:
        return float(np.abs(self.i).max())

    def near(self, level: float) -> Mask:
        """Readings (n,) that may be an open clamp's at ``level`` [A]."""
        return np.abs(self.i - level) <= max(_BAND * self.noise, 1e-9 * self.largest)


def seen(t: Array, u: Array, current: Array, onset: Onset) -> Seen:
    """Return readings at ``t`` [s] of ``u`` [V] and ``current`` [A], all (n,) without blanks."""
    noise = max(noise_level(current), resolution(current) / 4)
    rest = current[t < onset.time] if onset.first else np.empty(0)
    levels = [0.0]
    if len(rest) and abs(onset.rest) <= 0.02 * float(np.abs(u).max()):
        offset = float(np.median(rest))
        if abs(offset) > noise / 2:
            levels.append(offset)
    return Seen(t, u, current, int(np.searchsorted(t, onset.between[1])), tuple(levels), noise)


def port_of(s: Seen, within_run: bool) -> PassivePort:
    """Return the passive port of all readings."""
    return PassivePort(s.t, s.u, within_run)
