"""Records over time, ready for a fit: the drive from its onset on, and the quantities that were measured."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..arrays import Array, Mask
from ..drive import PiecewiseLinear
from ..findings import Finding
from .table import Headers


@dataclass(frozen=True)
class Channel:
    """One measured quantity: ``time`` [s] since the onset (negative: at rest), ``values`` [SI], blanks left out."""

    time: Array
    values: Array

    @property
    def rest(self) -> Mask:
        """Samples (n,) before the onset."""
        return self.time < 0

    def without(self, samples: Mask) -> Channel:
        """Return the channel without some ``samples`` (n,)."""
        return Channel(self.time[~samples], self.values[~samples])

    def until(self, end: float) -> Channel:
        """Return the samples up to ``end`` [s]."""
        return self.without(self.time > end)


@dataclass(frozen=True)
class Record:
    """A record made ready: ``onset`` [s] in the file's time, the ``drive`` from the onset on, and the channels.

    ``step`` [V] is the height of a step that begins the record, None for another waveform. ``notes`` say what was
    left out of the file and what is doubtful about it, ``headers`` the column and unit that each quantity has there.
    """

    source: str
    onset: float
    drive: PiecewiseLinear
    step: float | None
    current: Channel
    displacement: Channel | None
    notes: tuple[Finding, ...] = ()
    headers: Headers = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """Time from the onset to the last sample of the current [s]."""
        return float(self.current.time[-1])
