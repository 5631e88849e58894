"""Checks a record before any fit: clipped tops, drop-outs and drift, each a finding with its size."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Mask
from ..drive import PiecewiseLinear
from ..findings import Finding
from ..fit.criteria import effective_samples
from .contact import runs
from .jumps import voltage_jumps
from .onset import Beginning
from .passive import PassivePort
from .record import Channel
from .smoothing import resolution

#: Least number of neighbouring samples of a clipped top.
_CLIPPED = 3
#: Number of noise levels within which readings count as equal, if none are exactly equal.
_SAME = 4.0
#: Least fall beside a clipped top, in units of its flatness (noise or resolution): a smooth top falls less.
_BROKEN = 8.0
#: The same after a jump of the voltage, where an unclipped current falls fastest at first.
_BROKEN_AFTER_JUMP = 2.0
#: Least height of a clipped top, as a fraction of the largest current of either sign.
_TOP = 0.2
#: Change of the voltage beside a plateau, as a fraction of its largest, above which the plateau is the voltage's.
_DRIVEN = 0.05
#: Least excess of a fitted port's current over a limit, in units of the resolution or of the residuals elsewhere.
_BEYOND = 2.0
#: Fraction of a limit's readings that the fitted port's current must exceed.
_MOSTLY = 0.5
#: Distance from all other values, in their spans, above which a value is a mark for no reading; the same for zero.
_APART, _ZERO_APART = 3.0, 0.25
#: Least drift that is reported: in standard errors, and as a fraction of the largest reading.
_SURE, _WORTH_REPORTING = 5.0, 0.005
#: Largest ratio of the fall over the last third of a record to the middle third's in a settling transient.
_SLOWER = 0.6
_PARTS = 10
_FEWEST = 60


def clipped_tops(
    t: Array, current: Array, drive: PiecewiseLinear, noise: float, beginning: Beginning = "rest"
) -> tuple[Mask, tuple[Finding, ...]]:
    """Return the samples (n,) at the instrument's limit, positive and negative, and a finding for each limit.

    A flat top is clipped if the curve falls beside it by far more than beside a smooth top of the same length. Away
    from jumps, where vertices of the voltage make blunt tops, the current of a passive port fitted to all other
    readings must exceed it too.

    Parameters
    ----------
    t, current
        Time [s] since the onset, and current [A], both (n,).
    drive
        The voltage from the onset on.
    noise
        Standard deviation of the current's noise [A].
    beginning
        State before the record, see `PassivePort`.
    """
    dropped = np.zeros(len(t), dtype=bool)
    notes = []
    smallest = resolution(current)
    u = drive.value(np.maximum(t, 0.0))
    port: PassivePort | None = None
    for sign in (1.0, -1.0):
        v = sign * current
        top = float(v.max())
        if top <= _TOP * float(np.abs(v).max()):
            continue
        clipped = np.zeros(len(t), dtype=bool)
        for same in (1e-9 * top, _SAME * noise):  # equal readings, or else readings within the noise
            if clipped.any():
                break
            grain = max(same, smallest)
            tops = [(a, b) for a, b in runs(v >= top - same) if b - a >= _CLIPPED]
            smooth = [(a, b) for a, b in tops if not _after_jump(t, u, a)]
            for a, b in tops:
                clipped[a:b] = (a, b) in smooth or _breaks_off(t, v, u, a, b, grain)
            if smooth:
                port = port or PassivePort(t, np.where(t < 0, drive.rest, u), beginning, bool((t < 0).any()))
                beyond = _beyond(port, current, sign, clipped, max(grain, noise))
                for a, b in smooth:
                    clipped[a:b] = beyond[a:b].mean() > _MOSTLY
        if clipped.any():
            level = float(np.median(current[clipped]))
            notes.append(Finding("current-clipped", values={"level": level, "count": int(clipped.sum())}))
            dropped |= clipped
    return dropped, tuple(notes)


def _beyond(port: PassivePort, current: Array, sign: float, flat: Mask, grain: float) -> Mask:
    """Return the readings (n,) that are significantly exceeded by a port fitted to all except the ``flat`` ones."""
    v = sign * current
    other = v <= float(v.min()) + 1e-9 * float(np.abs(v).max())  # possibly the other limit
    used = ~flat & ~other if other.sum() >= _CLIPPED and v.min() < -_TOP * v.max() else ~flat
    if used.sum() < _FEWEST:
        return np.zeros(len(v), dtype=bool)
    fitted = port.fit(current, used)
    return sign * fitted.current - v > _BEYOND * max(grain, fitted.rms)


def blanks(values: Array, quantity: str, told: int = 0) -> tuple[Finding, ...]:
    """Return a finding on the rows (n,) in which a ``quantity`` has no number, apart from the ``told`` ones."""
    count = int(np.isnan(values).sum()) - told
    about = {"quantity": quantity, "count": count, "total": len(values)}
    return (Finding("rows-blank", values=about),) if count > 0 else ()


def dropouts(values: Array, quantity: str, unit: str) -> tuple[Mask, tuple[Finding, ...]]:
    """Return a mask (n,) of drop-outs, and findings on them: blanks, and one value far from all others.

    Such a value occurs between good readings. ``values`` (n,) are of a ``quantity`` in an SI ``unit``.
    """
    blank = np.isnan(values)
    notes = [*blanks(values, quantity)]
    known = values[~blank]
    missing = blank.copy()
    if len(known):
        for c in dict.fromkeys((float(known.max()), float(known.min()), 0.0)):
            signs = ~missing & (values == c)
            others = values[~missing & ~signs]
            if not signs.any() or len(others) < len(known) / 2 or not _between(signs, missing):
                continue
            gap = max(float(others.min()) - c, c - float(others.max()))
            if gap > (_APART if c else _ZERO_APART) * float(np.ptp(others)):
                described = {"count": int(signs.sum()), "reading": c, "unit": unit, "quantity": quantity}
                notes.append(Finding("readings-apart", values=described))
                missing |= signs
    return missing, tuple(notes)


def current_drift(current: Channel, step: float) -> tuple[Finding, ...]:
    """Return findings on a ``current`` [A] that rises again after a step at 0 s, or has not settled.

    Every linear model's current falls monotonically after a step, so a rise is the strip's or the instrument's drift.
    A drift that the rest shows is not one of them, since it is fitted.
    """
    after = ~current.rest
    if after.sum() < _FEWEST:
        return ()
    time, rest = current.time[after], current.at_rest
    v = np.sign(step) * (current.values[after] - (rest.slope * time if rest.drifts else 0.0))
    peak = float(np.abs(v).max())
    means, errors, middles = _means(time, v)
    if len(means) < 3:
        return ()
    k = int(np.argmin(means))
    rise, sure = means[-1] - means[k], _SURE * float(np.hypot(errors[k], errors[-1]))
    if rise > max(sure, _WORTH_REPORTING * peak):
        return (Finding("current-rises", values={"rise": float(rise), "since": float(middles[k])}),)
    if len(means) < _PARTS - 1:
        return ()
    early, late = means[-7], means[-4]  # three tenths of the time from one to the next
    fall = late - means[-1]
    if fall > max(sure, _WORTH_REPORTING * peak, _SLOWER * (early - late)):
        return (Finding("current-not-settled", values={"fall": float(fall)}),)
    return ()


def rest_drift(channel: Channel, quantity: str, unit: str) -> tuple[Finding, ...]:
    """Return a finding on a drift of a ``channel`` [SI] before the onset, by a straight line."""
    rest = channel.at_rest
    if rest.count < 2 * _PARTS:
        return ()
    moved = rest.slope * float(np.ptp(channel.time[channel.rest]))
    if rest.drifts and abs(moved) > 2 * _WORTH_REPORTING * float(np.ptp(channel.values)):
        return (Finding("rest-drifts", values={"quantity": quantity, "drift": moved, "unit": unit}),)
    return ()


def _between(signs: Mask, missing: Mask) -> bool:
    """Return True if there are good readings before and after all ``signs``; a rest position begins the record."""
    good = np.flatnonzero(~signs & ~missing)
    where = np.flatnonzero(signs)
    return bool(len(good) and good[0] < where[0] and where[-1] < good[-1])


def _breaks_off(t: Array, v: Array, u: Array, a: int, b: int, grain: float) -> bool:
    """Return True if the curve beside the top v[a:b], extrapolated into it, rises well beyond ``grain``."""
    length = t[b - 1] - t[a]
    largest = float(np.abs(u).max())
    steady = float(np.ptp(u[a:b])) <= _DRIVEN * largest
    limit = grain * (_BROKEN_AFTER_JUMP if steady and _after_jump(t, u, a) else _BROKEN)
    for edge, far in (
        (b - 1, int(np.searchsorted(t, t[b - 1] + length, side="right")) - 1),
        (a, int(np.searchsorted(t, t[a] - length))),
    ):
        low, high = sorted((edge, far))
        if high - low < 2 or t[low] < 0 or float(np.abs(np.diff(u[low : high + 1])).max()) > _DRIVEN * largest:
            continue  # too few readings beside it, or a jump of the voltage
        if steady and abs(u[far] - u[edge]) > _DRIVEN * largest:
            continue
        if (v[edge] - v[far]) / 2 > limit:
            return True
    return False


def _after_jump(t: Array, u: Array, a: int) -> bool:
    """Return True if the voltage jumps, or the drive begins, where the top begins."""
    around = slice(max(a - 8, 0), a + 8)
    return bool(a == 0 or t[a - 1] < 0 <= t[a] or a - 1 - around.start in voltage_jumps(u[around]))


def _means(time: Array, v: Array) -> tuple[Array, Array, Array]:
    """Return means of ``v`` in equal windows of time, except the first, their standard errors and the middles [s]."""
    part = np.minimum((_PARTS * time / time[-1]).astype(int), _PARTS - 1)
    rows = []
    for k in range(1, _PARTS):
        x, y = time[part == k], v[part == k]
        if len(y) < 5:
            continue
        residuals = y - np.polynomial.Polynomial.fit(x, y, 1)(x)
        error = float(residuals.std()) / np.sqrt(effective_samples(residuals))
        rows.append((float(y.mean()), error, float(x.mean())))
    means, errors, middles = np.array(rows).reshape(-1, 3).T
    return means, errors, middles
