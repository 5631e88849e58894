"""Computes the misfit of a model: residuals beyond the noise, relative to the data's size.

The root mean square is taken over windows evenly spaced in log time, since over all samples a long tail would dominate
a fast beginning. Thresholds are from trials with random parameters: misfits of 1 to 2 % correspond to errors of 28 % in
Rdc at the 90th percentile.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array
from .criteria import ResidualWindow, residual_windows

#: Misfits, as fractions of the data's size, above which there is a warning, and failure, overall or in one window.
WARN, FAIL, FAIL_WINDOW = 0.02, 0.10, 0.25
#: Misfits for warning and failure of spectra, complex and relative.
WARN_SPECTRUM, FAIL_SPECTRUM = 0.03, 0.20
#: Largest chi^2 explained by noise: a quantile in a window, and a number of deviations of the overall mean.
_QUANTILE, _DEVIATIONS = 0.999, 3.0


@dataclass(frozen=True)
class Misfit:
    """The misfit as a ``share`` of the data's size; ``worst`` is the misfit of the worst window, ``start`` to ``end``.

    These are times in s since the onset, or frequencies in Hz. ``warn`` and ``fail`` are the limits of the share.
    """

    share: float
    worst: float
    start: float
    end: float
    warn: bool
    fail: bool

    def to_dict(self) -> dict[str, Any]:
        window = {"from": self.start, "to": self.end, "share": self.worst}
        return {"share": self.share, "worst": window, "warn": self.warn, "fail": self.fail}


def misfit_over_time(time: Array, residuals: Array, noise: float, size: float) -> Misfit | None:
    """Return the misfit of a record; None if no sample lies after the onset at 0.

    Parameters
    ----------
    time, residuals
        Time since the onset [s], and data - model (n,).
    noise, size
        The data's white noise, and the reference size of a misfit, in the data's unit.
    """
    windows = residual_windows(time, residuals, float(time[-1]))
    if not windows or not size:
        return None
    counts = np.array([w.count for w in windows])
    squares = np.array([w.rms**2 for w in windows])
    chance = 1 + _DEVIATIONS * float(np.sqrt((2 / counts).sum())) / len(windows)
    share = float(np.sqrt(max(float(squares.mean()) - noise**2 * chance, 0.0))) / size
    shares = np.array([_beyond(w, noise) for w in windows]) / size
    k = int(np.argmax(shares))
    worst = float(shares[k])
    return Misfit(
        share, worst, windows[k].start, windows[k].end,
        warn=bool(share > WARN), fail=bool(share > FAIL or worst > FAIL_WINDOW),
    )  # fmt: skip


def deviations_over_time(time: Array, residuals: Array, noise: float) -> tuple[Array, Array]:
    """Return the middles [s] (w,) of windows since the onset, and the misfit beyond the noise (w,) in each."""
    windows = residual_windows(time, residuals, float(time[-1]))
    edge = min((w.end for w in windows), default=1.0)
    middles = [np.sqrt(w.start * w.end) if w.start else edge / 2 for w in windows]
    return np.array(middles), np.array([_beyond(w, noise) for w in windows])


def _beyond(window: ResidualWindow, noise: float) -> float:
    """Return the root mean square of a window beyond the plausible noise."""
    from scipy.special import gammaincinv

    chi_square = 2 * float(gammaincinv(window.count / 2, _QUANTILE))
    allowed = noise**2 * chi_square / window.count
    return float(np.sqrt(max(window.rms**2 - allowed, 0.0)))


def misfit_of_spectrum(frequency: Array, relative: Array) -> Misfit:
    """Return the misfit of a spectrum from abs(data - model)/abs(data) (n,) at ``frequency`` [Hz] (n,), ascending.

    The worst window is the decade with the largest root mean square.
    """
    share = float(np.sqrt(np.mean(relative**2)))
    decade = np.floor(np.log10(frequency))
    each = {d: float(np.sqrt(np.mean(relative[decade == d] ** 2))) for d in np.unique(decade).tolist()}
    d = max(each, key=lambda key: each[key])
    return Misfit(share, each[d], 10.0**d, 10.0 ** (d + 1), warn=share > WARN_SPECTRUM, fail=share > FAIL_SPECTRUM)
