"""Finds outliers of a current, which no model error explains, and leaves them out before models are compared."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Mask
from ..drive import PiecewiseLinear
from ..errors import IlgError
from ..findings import Finding
from ..fit.outliers import outlying
from ..measurements.record import Channel
from ..measurements.smoothing import resolution
from ..strip.models import electrical_model
from .current import CurrentData

#: Models for the residuals, of which the first that can be fitted is used.
_MODELS = ("rc2", "rc")
#: Largest fraction of outliers among the rows; with more, they are not outliers.
_MOST = 0.02
_ROUNDS = 6
#: Rows of a displacement's running median, and the fewest readings that have one.
_MEDIAN, _FEWEST = 5, 20
#: Window of the local noise in rows; ratio of the median difference of neighbours to the standard deviation.
_WINDOW, _OF_DIFFERENCES = 51, 0.6745 * np.sqrt(2)
#: Residuals without noise, as a fraction of the largest reading, below which they are rounding of the solvers.
_ROUNDING = 1e-7


def without_outliers(data: CurrentData, held: float) -> tuple[CurrentData, list[Finding]]:
    """Return the data without the readings that are named as outliers, and a finding on them.

    Fits are repeated until no further outlier is found. If no model can be fitted, nothing is left out.
    """
    for _ in range(_ROUNDS):
        residuals = _residuals(data, held)
        if residuals is None:
            break
        more = named_by(data, residuals)
        if not len(more):
            break
        data = data.leaving_out(more)
    return data, findings_on(data)


def named_by(data: CurrentData, residuals: Array) -> NDArray[np.intp]:
    """Return the rows of the record's current that ``residuals`` (samples,) of the data name as outliers."""
    pieces = np.searchsorted(data.drive.jumps(np.inf), data.since, side="right") + (data.since >= 0)
    grain = max(resolution(data.data), _ROUNDING * data.size)
    found = outlying(data.data, residuals, pieces, grain)
    return data.rows[found]


def spikes(channel: Channel, drive: PiecewiseLinear) -> Mask:
    """Return the readings (n,) of a displacement that are outliers relative to their neighbours.

    A displacement is continuous, so that deviations from a running median are used in place of a model's residuals.
    """
    from scipy.ndimage import median_filter

    if len(channel.time) < _FEWEST:
        return np.zeros(len(channel.time), dtype=bool)
    residuals = channel.values - median_filter(channel.values, _MEDIAN, mode="nearest")
    pieces = np.searchsorted(drive.jumps(np.inf), channel.time, side="right") + (channel.time >= 0)
    # the median follows the noise, so deviations from it are too small: differences of neighbours give the noise
    steps = np.abs(np.diff(channel.values))
    noise = median_filter(np.append(steps, steps[-1]), _WINDOW, mode="reflect")
    noise = (
        np.maximum(noise, float(np.median(steps)) / 2) / _OF_DIFFERENCES
    )  # a few rows may have little noise by chance
    return outlying(channel.values, residuals, pieces, np.maximum(noise, resolution(channel.values)), jumps=False)


def findings_on(data: CurrentData) -> list[Finding]:
    """Return findings on the readings of a current that were left out."""
    return left_out(data.channel, np.array(data.left_out, dtype=np.intp), data.source, data.quantity, data.unit)


def left_out(channel: Channel, rows: NDArray[np.intp], source: str, quantity: str, unit: str) -> list[Finding]:
    """Return a finding on ``rows`` of a channel that were left out, if there are any."""
    if not len(rows):
        return []
    shown = [f"{channel.time[k] + channel.zero:.6g} s ({channel.values[k]:.3g} {unit})" for k in rows[:8].tolist()]
    values = {"count": len(rows), "of": len(channel.time), "readings": shown + ["..."] * (len(rows) > 8)}
    code = "outliers-many" if len(rows) > _MOST * len(channel.time) else "outliers"
    return [Finding(code, source, {"quantity": quantity, **values})]


def _residuals(data: CurrentData, held: float) -> Array | None:
    for model in _MODELS:
        try:
            return data.rough_residuals(electrical_model(model), held)
        except IlgError:
            continue
    return None
