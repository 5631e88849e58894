"""Finds outliers in a record over time: single rows far from both their neighbours and the model.

A model that is too simple leaves residuals as smooth as the transient; a reading is named only where it stands apart
from its neighbours' residuals, by far more than they scatter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Mask

#: Least distance of an outlier, in standard deviations of the residuals and in ranges of its neighbours.
_FAR, _OVER_NEIGHBOURS = 6.0, 1.5
#: Number of neighbours; half-width in rows of the window for the residuals' standard deviation.
_NEIGHBOURS, _HALF = 4, 25
#: Median absolute deviation of a normal variable of unit deviation.
_MAD = 0.6745
#: Number of rows after an edge of the drive that are outliers only if their response is smaller than the next row's.
_BEHIND_EDGE = 2


def outlying(
    data: Array, residuals: Array, pieces: NDArray[np.intp], grain: float | Array, *, jumps: bool = True
) -> Mask:
    """Return a mask (n,) of the readings that are outliers.

    Parameters
    ----------
    data, residuals
        Readings and data - model (n,), in one unit.
    pieces
        Number (n,) of the smooth piece of the drive to which each row belongs, ascending, 0 at rest; neighbours never
        lie across an edge.
    grain
        The least significant deviation of a reading, in the same unit, or one for each (n,): the instrument's
        resolution.
    jumps
        True if the quantity jumps with the drive and decays from there, as a current does; otherwise the rows after an
        edge are never outliers.
    """
    named = np.zeros(len(data), dtype=bool)
    everywhere = _deviation(residuals)
    least = np.broadcast_to(grain, data.shape)
    for piece in np.unique(pieces):
        rows = np.flatnonzero(pieces == piece)
        if len(rows) <= _NEIGHBOURS:
            continue
        r = residuals[rows]
        scale = np.maximum(everywhere, least[rows])
        if not (np.abs(r) > _FAR * scale).any():
            continue
        scale = np.maximum(scale, _local_deviation(r))
        found = np.abs(r) > _FAR * scale
        far = np.flatnonzero(found)
        around = r[_neighbours(far, len(rows))]
        distance = np.abs(r[far] - np.median(around, axis=1))
        found[far] = (distance > _FAR * scale[far]) & (distance > _OVER_NEIGHBOURS * np.ptp(around, axis=1))
        if piece:  # a record without rest begins at an edge, too
            answer = np.abs(data[rows] - (float(data[rows[0] - 1]) if rows[0] else 0.0))
            for k in range(_BEHIND_EDGE):
                found[k] &= jumps and bool(answer[k] < answer[k + 1])
        named[rows[found]] = True
    return named


def _deviation(values: Array) -> float:
    return float(np.median(np.abs(values - np.median(values)))) / _MAD


def _local_deviation(r: Array) -> Array:
    """Return the deviation of ``r`` (n,) in a window about each row, by its median absolute deviation."""
    from scipy.ndimage import median_filter

    width = min(2 * _HALF + 1, len(r) - 1 + len(r) % 2)
    middle = median_filter(r, width, mode="nearest")
    return np.asarray(median_filter(np.abs(r - middle), width, mode="nearest")) / _MAD


def _neighbours(rows: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Return the nearest of ``count`` rows (m, 4) to each of ``rows`` (m,), at the ends those inwards."""
    first = np.clip(rows - _NEIGHBOURS // 2, 0, count - _NEIGHBOURS - 1)
    window = first[:, None] + np.arange(_NEIGHBOURS + 1)
    return window[window != rows[:, None]].reshape(-1, _NEIGHBOURS)
