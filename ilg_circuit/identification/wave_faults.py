"""Finds what is wrong with the readings of a record of waves: missing rows, answers at a limit, frames held.

Readings between others that are too far apart are no readings: a straight line there is another motion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Array, Mask
from ..errors import InputError
from ..findings import Finding
from ..measurements.saturation import saturated
from ..measurements.smoothing import resolution
from ..measurements.waves import FEWEST, Waves
from .excitation import GAP, crossings

#: Part of the voltage's span by which it leaves its rest.
_LEAVES = 1e-2
#: Part of the readings that repeat the one before from which on frames are held, and the change of the others then, in
#: steps of the resolution.
_HELD, _STEPS = 0.1, 5.0
#: Longest time without readings in periods of a sweep there, if a spline bridges few steps, and if a line bridges more;
#: factor by which the frequencies affected reach further.
_BY_SPLINE, _BY_LINE, _BESIDE = 0.35, 0.1, 1.3
#: Steps over which a spline bridges missing readings: beyond them it would follow the noise.
BRIDGED = 4.5
#: Missing readings in a row that cut noise in two.
_CUT = 10.0

Gap = tuple[float, float]


def sound(waves: Waves) -> tuple[Waves, tuple[Finding, ...]]:
    """Return the record without answers that stand at a limit and rows of held frames, and findings on them.

    Raises InputError if no motion or force, or too few rows, are left.
    """
    findings: list[Finding] = []
    answers = dict(waves.answers)
    away = np.abs(waves.voltage - waves.voltage[0]) > _LEAVES * float(np.ptp(waves.voltage))
    onset = float(waves.time[int(np.argmax(away))])
    for name, values in waves.answers.items():
        stuck, _ = saturated(waves.time - onset, values)
        if stuck.any():
            del answers[name]
            level = float(values[stuck][np.argmax(np.abs(values[stuck]))])
            about = {"quantity": name, "count": int(stuck.sum()), "of": len(values), "level": level}
            findings.append(Finding("answer-clipped", values=about))
    if not answers.keys() & {"displacement", "force"}:
        said = "; ".join(map(str, findings))
        raise InputError(f"{waves.source}: {said}: no motion is left; measure with less voltage or a wider range")
    kept = np.ones(len(waves.time), dtype=bool)
    for name in [name for name in answers if name != "current"]:
        held = _held(answers[name], waves.time >= onset)
        if held.any():
            kept &= ~held
            findings.append(
                Finding("frames-held", values={"quantity": name, "count": int(held.sum()), "of": len(held)})
            )
    if kept.all():
        return replace(waves, answers=answers), tuple(findings)
    if kept.sum() < FEWEST:
        raise InputError(
            f"{waves.source}: {findings[-1]}: {int(kept.sum())} readings are left, and a response needs {FEWEST}; give "
            "the camera's own times"
        )
    return _rows(replace(waves, answers=answers), kept), tuple(findings)


def gaps(t: Array) -> list[Gap]:
    """Return the times [s] before and after the readings missing from ``t`` (n,)."""
    steps = np.diff(t)
    return [(float(t[k]), float(t[k + 1])) for k in np.flatnonzero(steps > GAP * float(np.median(steps)))]


def longest_stretch(waves: Waves) -> tuple[Waves, tuple[Finding, ...]]:
    """Return the longest part of a record without many readings missing in a row, and a finding if it is not all."""
    steps = np.diff(waves.time)
    cuts = np.flatnonzero(steps > _CUT * float(np.median(steps)))
    if not len(cuts):
        return waves, ()
    ends = np.r_[0, cuts + 1, len(waves.time)]
    k = int(np.argmax(np.diff(ends)))
    part = np.zeros(len(waves.time), dtype=bool)
    part[ends[k] : ends[k + 1]] = True
    left = _rows(waves, part)
    longest = int(np.argmax(steps))
    about = {
        "from": float(waves.time[longest]),
        "long": float(steps[longest]),
        "begin": float(left.time[0]),
        "end": float(left.time[-1]),
    }
    return left, (Finding("longest-stretch", values=about),)


def not_swept(t: Array, u: Array, low: float, high: float, frequency: Array) -> tuple[Mask, tuple[Finding, ...]]:
    """Return the frequencies (f,) [Hz] that a sweep passes while readings are missing, and findings on them.

    Its voltage ``u`` (n,) at ``t`` [s] (n,) sweeps between the frequencies ``low`` and ``high`` [Hz].
    Readings that are missing for a small part of a period can be read off between their neighbours.
    """
    times = crossings(t, u)
    halves, middles = np.diff(times), times[:-1] + np.diff(times) / 2
    every, step = gaps(t), float(np.median(np.diff(t)))
    # half periods without readings for a half of them are not known
    whole = np.ones(len(halves), dtype=bool)
    for a, b in every:
        whole &= (a >= times[1:]) | (b <= times[:-1]) | (b - a < halves / 2)
    ends = (low, high) if halves[0] > halves[-1] else (high, low)
    lost = np.zeros(len(frequency), dtype=bool)
    findings: list[Finding] = []
    for a, b in every:
        before, after = np.flatnonzero(whole & (middles < a)), np.flatnonzero(whole & (middles > b))
        near = [
            float(0.5 / halves[before[-1]]) if len(before) else ends[0],
            float(0.5 / halves[after[0]]) if len(after) else ends[1],
        ]
        limit = _BY_SPLINE if b - a < BRIDGED * step else _BY_LINE
        if (b - a) * max(near) <= limit:
            continue
        out = (frequency >= min(near) / _BESIDE) & (frequency <= max(near) * _BESIDE)
        if (out & ~lost).any() or not out.any():
            shown = frequency[out] if out.any() else np.sort(near)
            about = {"from": a, "long": b - a, "low": float(shown[0]), "high": float(shown[-1])}
            findings.append(Finding("sweep-gap", values=about))
        lost |= out
    return lost, tuple(findings)


def _held(values: Array, moving: Mask) -> Mask:
    """Return the readings (n,) that repeat the one before, if these are a camera's held frames."""
    same = np.append(False, np.diff(values) == 0) & moving
    steps = np.abs(np.diff(values[moving]))
    if same.sum() <= _HELD * moving.sum() or not steps.any():
        return np.zeros(len(values), dtype=bool)
    coarse = float(np.median(steps[steps > 0])) < _STEPS * resolution(values)
    return np.zeros(len(values), dtype=bool) if coarse else same


def _rows(waves: Waves, kept: Mask) -> Waves:
    answers = {name: values[kept] for name, values in waves.answers.items()}
    return replace(waves, time=waves.time[kept], voltage=waves.voltage[kept], answers=answers)
