"""The motion of a sense record as a drive: smooth between its readings, with jumps in unknown places between them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import InputError
from ..measurements.onset import Onset
from ..measurements.smoothing import digit, noise_beside_kinks, noise_level
from ..measurements.voltage import MeasuredDrive, answer_to_noise, measured_drive
from ..measurements.waves import Sensed
from ..units import format_quantity

#: Ratio of an interval to those beside it from which on it is a gap, readings on either side that show a tip that
#: stands still, and their largest span, as a fraction of the motion's and in noise levels.
_GAP, _BESIDE, _STILL, _OVER_NOISE = 4.0, 3, 0.02, 6.0
#: Order of the differences that contain a motion's noise alone, sum of their squared autocorrelations; significance
#: of an answer, in standard errors.
_ORDER, _CORRELATED, _SURE = 6, 3.2, 6.0


@dataclass(frozen=True)
class SensedData:
    """A sense ``record`` with its motion as a drive, whose readings have ``noise`` [m], as `jumps.Jumping` data.

    Jumps are ``share`` of their intervals from the middles, and ``places`` [s] besides.
    """

    record: Sensed
    measured: MeasuredDrive
    noise: float
    share: float = 0.0
    places: tuple[float, ...] = ()

    @classmethod
    def of(cls, record: Sensed) -> SensedData:
        """Return the data of a record. Raises InputError for a gap in which the tip may have moved."""
        _require_no_gap(record)
        moved = record.displacement
        answered = _answers_noise(moved, record.signal)
        return cls(record, _motion(record.time, moved, answered), 0.0 if answered else _noise(moved))

    @property
    def onset_width(self) -> float:
        """Zero: the motion begins with the record."""
        return 0.0

    @property
    def drive(self) -> PiecewiseLinear:
        """The motion [m] since the first reading."""
        return replace(self.measured, places=self.places).moved(self.share, 0.0)

    @property
    def jumps(self) -> bool:
        """True if the tip jumps between readings."""
        return bool(self.measured.widths[1:].any())

    def again(self, random: np.random.Generator) -> SensedData:
        """Return the data as they would be with other noise of the motion's readings."""
        t = self.record.time
        moved = self.measured.drive.value(t) + self.noise * random.standard_normal(len(t))
        found = _motion(t, moved, answered=False)
        same = len(found.widths) == len(self.measured.widths)
        return replace(self, measured=found, places=self.places if same else ())

    @property
    def abscissa(self) -> Array:
        return self.record.time

    @property
    def data(self) -> Array:
        return self.record.signal

    def at_share(self, share: float) -> SensedData:
        return replace(self, share=share)

    def at_places(self, places: Array) -> SensedData:
        return replace(self, places=tuple(places.tolist()))


def _motion(t: Array, moved: Array, answered: bool) -> MeasuredDrive:
    """Return readings of a motion [m] (n,) as a drive from its beginning, smoothed unless the strip ``answered``."""
    onset = Onset(0, (0.0, 0.0), 0.0, "rest", jumps=False)
    found = measured_drive(t, moved - moved[0], onset, 0.0, 0.0, answered)
    drive = found.drive
    return replace(found, drive=PiecewiseLinear(drive.times, drive.values - drive.values[0], drive.text, unit="m"))


def _noise(moved: Array) -> float:
    """Return the standard deviation [m] of the noise of readings."""
    return noise_beside_kinks(moved, digit(moved))


def _require_no_gap(record: Sensed) -> None:
    """Raise InputError for an interval without readings beside which the tip moves."""
    t, moved = record.time, record.displacement
    widths = np.diff(t)
    beside = np.maximum(np.append(widths[1], widths[:-1]), np.append(widths[1:], widths[-2]))
    still = max(_STILL * float(np.ptp(moved)), _OVER_NOISE * noise_level(moved))
    for k in np.flatnonzero(widths > _GAP * beside).tolist():
        if float(np.ptp(moved[max(k + 1 - _BESIDE, 0) : k + 1 + _BESIDE])) > still:
            first, last = (format_quantity(float(x), "s", 4) for x in t[k : k + 2])
            raise InputError(
                f"{record.source}: no readings from {first} to {last} of the record, while the tip moves: how it moved "
                "there is not known; give the part before or after"
            )


def _answers_noise(moved: Array, signal: Array) -> bool:
    """Return True if the signal (n,) follows what looks like noise of the motion (n,): then the tip did move so."""
    if len(moved) < 2 * _SURE**2:
        return False
    slope, error = answer_to_noise(moved, signal, _ORDER, _CORRELATED)
    return abs(slope) > _SURE * error
