"""Responses of a linear system to any drive from its step, ramp and sine responses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Array
from ..drive import Drive, PiecewiseLinear, Sine
from ..errors import InputError


def superpose(drive: Drive, t: Array, response: Callable[..., Any]) -> Array:
    """Return the response at ``t`` [s]: steps at a drive's jumps, ramps at its bends, or a sine as it is.

    ``response(kind, time)`` gives the answer (..., time) to a "step" of 1 V and a "ramp" of 1 V/s at time 0, and
    ``response("sine", time, frequency)`` that to a sine of 1 V. Raises InputError for another kind of drive.
    """
    if isinstance(drive, Sine):
        return np.asarray(drive.amplitude * response("sine", t, drive.frequency))
    if not isinstance(drive, PiecewiseLinear):
        raise InputError("only piecewise linear and sine drives can be superposed")
    # a little beyond the end, so that a jump there counts; jumps keep their two points at one time
    times, values = drive.widened(float(t[-1]) * (1 + 1e-9), 0.0)
    widths, heights = np.diff(times), np.diff(values)
    result = np.array(values[0] * response("step", t))
    slope = 0.0
    for k in range(len(widths)):
        started = int(np.searchsorted(t, times[k]))
        if widths[k] == 0:
            result[..., started:] += heights[k] * response("step", t[started:] - times[k])
        elif heights[k] / widths[k] != slope:
            result[..., started:] += (heights[k] / widths[k] - slope) * response("ramp", t[started:] - times[k])
            slope = heights[k] / widths[k]
    return result
