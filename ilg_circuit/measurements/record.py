"""Records over time, ready for a fit: the drive from its onset on, and the measured quantities."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, Mask, plain
from ..drive import PiecewiseLinear
from ..findings import Finding, sentences
from ..result import Column, Result
from .onset import Beginning, Bracket
from .rest import Rest
from .table import Headers
from .voltage import MeasuredDrive


@dataclass(frozen=True)
class Channel:
    """One measured quantity: ``time`` [s] since the onset (negative: at rest), ``values`` [SI], blanks left out.

    The onset lies in ``bracket`` [s] about 0, between the last reading at rest and the first one of the response;
    ``zero`` [s] is the middle of the bracket in the file's time.
    """

    time: Array
    values: Array
    bracket: Bracket = (0.0, 0.0)
    zero: float = 0.0

    @property
    def rest(self) -> Mask:
        """Samples (n,) before the onset."""
        return self.time < 0

    @cached_property
    def at_rest(self) -> Rest:
        """The line through the readings before the onset."""
        return Rest.of(self.time, self.values)

    def without(self, samples: Mask) -> Channel:
        """Return the channel without some ``samples`` (n,)."""
        if not samples.any():
            return self
        return replace(self, time=self.time[~samples], values=self.values[~samples])

    @property
    def width(self) -> float:
        """Width of the bracket [s]."""
        return self.bracket[1] - self.bracket[0]

    def since(self, share: float) -> Array:
        """Return the times [s] since an onset at the position ``share`` (-0.5 to 0.5) in the bracket, 0 in the middle.

        Readings at rest stay before it.
        """
        onset = share * self.width
        if not onset:
            return self.time
        return np.where(self.rest, np.minimum(self.time, self.time - onset), np.maximum(self.time - onset, 0.0))

    def until(self, end: float) -> Channel:
        """Return the samples up to ``end`` [s]."""
        return self.without(self.time > end)


@dataclass(frozen=True)
class Forced:
    """What a source of current forced through the strip: its ``drive`` [A], and the ``voltage`` [V] that answered."""

    drive: MeasuredDrive
    voltage: Channel


@dataclass(frozen=True, repr=False, eq=False)
class Record(Result):
    """A measured record over time, ready for a fit, as `ilg_circuit.read` returns it.

    Attributes
    ----------
    source : str
        Name of the file or of the data.
    onset : float
        When the excitation began, in the file's time [s].
    voltage : MeasuredDrive
        Voltage from the onset on; ``voltage.drive`` is the waveform, whose times count from there.
    step : float or None
        Level of a step that begins the record [V], None for another waveform.
    current : Channel
        Current: ``time`` [s] from the onset and ``values`` [A].
    displacement : Channel or None
        Displacement likewise [m].
    notes : tuple of Finding
        Findings on readings that were left out or are doubtful.
    beginning : Beginning
        State before the onset: "rest", "step" or "run".
    headers : Headers
        Column and unit of each quantity in the file.
    own_clock : bool
        True if the displacement comes from a separate file, with a separate clock. ``displacement.zero`` is then
        approximately the time at which the tip begins to move.
    forced : Forced or None
        Of a record whose current was controlled: that current as a drive, and the voltage that answered it.
    """

    presenter: ClassVar[str] = "measured"

    source: str
    onset: float
    voltage: MeasuredDrive
    step: float | None
    current: Channel
    displacement: Channel | None
    notes: tuple[Finding, ...] = ()
    beginning: Beginning = "rest"
    headers: Headers = field(default_factory=dict)
    own_clock: bool = False
    forced: Forced | None = None

    @property
    def drive(self) -> PiecewiseLinear:
        """The voltage over time since the onset at 0."""
        return self.voltage.drive

    @property
    def late(self) -> float:
        """How late the current answers the voltage's jump [s], where that is more than one reading, else 0."""
        return float(next((note.values["late"] for note in self.notes if note.code == "current-late"), 0.0))

    @property
    def duration(self) -> float:
        """Time from the onset to the last sample of the current [s]."""
        return float(self.current.time[-1])

    @property
    def warnings(self) -> tuple[str, ...]:
        """The notes as sentences."""
        return sentences(self.notes)

    def table(self) -> tuple[Column, ...]:
        """Return time since the onset [s] (n,), voltage, current and displacement; NaN where there is no reading."""
        channels = {"current": (self.current, "A"), "displacement": (self.displacement, "m")}
        known = {name: (channel, unit) for name, (channel, unit) in channels.items() if channel is not None}
        times = np.unique(np.concatenate([channel.time for channel, _ in known.values()]))
        voltage = np.where(times < 0, self.drive.rest, self.drive.value(times))
        columns = [Column("time", times, "s", over=True), Column("voltage", voltage, "V")]
        for name, (channel, unit) in known.items():
            values = np.full(len(times), np.nan)
            values[np.searchsorted(times, channel.time)] = channel.values
            columns.append(Column(name, values, unit))
        return tuple(columns)

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain data, lists by header."""
        readings = {header: plain(values) for header, values in self.columns().items()}
        about = {"source": self.source, "onset_s": self.onset, "step_V": self.step}
        return about | {"readings": readings, "warnings": list(self.warnings)}
