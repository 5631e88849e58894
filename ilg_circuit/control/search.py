"""The law of a kind that settles soonest and is robust: many are judged at once, the best ones varied."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.stats import qmc

from ..arrays import Array, Mask
from ..errors import InputError
from .laws import Law, law_of
from .loop import BAND
from .margins import frequencies, margins
from .plant import Plant, responses

#: Laws in the first round and in each of those about the best, how many these are, their spread [log] round by round.
FIRST, ROUND = 256, 64
_BEST, _SPREADS = 6, (0.3, 0.15, 0.07)
#: Samples of the strip at which the search judges; all judge the answer. Periods of the sampled loop of the search.
_JUDGES, _PERIODS = 8, 1200
#: How much smaller than allowed the search keeps the largest sensitivity.
_INSIDE = 0.995
#: Frequencies at which the search judges a loop, and those few at which a bad one is seen at once.
_POINTS, _FEW = 300, 40


@dataclass(frozen=True)
class Wish:
    """What a law shall do: a ``step`` [m] within ``limit`` [V] measured ``delay`` [s] late.

    ``most`` is the largest sensitivity and ``overshoot`` the largest part of the step that are allowed; ``settling``
    [s] or ``bandwidth`` [Hz] the goal, the soonest settling without one; ``bound`` [s] is what no law betters.
    """

    step: float
    limit: float
    delay: float
    most: float
    overshoot: float
    bound: float
    settling: float | None = None
    bandwidth: float | None = None


def ranges(kind: str, plant: Plant) -> dict[str, tuple[float, float]]:
    """Return what gains of a kind are searched between [SI], from the strip's gain and time constants."""
    slow = float(np.abs(plant.poles.real).min())
    fast = float(np.abs(plant.poles).max())
    unit = 1 / abs(plant.gain)
    if kind == "pi":
        return {"gain": (0.03 * unit, 300 * unit), "reset_time": (0.1 / slow, 4 / slow), "weight": (0.2, 1.0)}
    if kind == "pid":
        return {
            "gain": (0.03 * unit, 300 * unit),
            "reset_time": (0.1 / slow, 4 / slow),
            "derivative_time": (0.02 / fast, 3 / slow),
            "weight": (0.2, 1.0),
        }
    if kind == "lqg":
        return {
            "speed": (0.3 * slow, 100 * fast),
            "observer": (0.3 * slow, 100 * fast),
            "integral": (0.1 * slow, 10 * slow),
        }
    return {"bandwidth": (0.5 * slow, 100 * fast), "observer": (2.0, 20.0)}


def best_law(
    kind: str, plants: list[Plant], wish: Wish, seed: int = 0, progress: Callable[[int, int], None] | None = None
) -> Law:
    """Return the law of a ``kind`` for the first of ``plants`` that grants a wish best and is robust for all of them.

    Raises InputError where none is robust.
    """
    box = ranges(kind, plants[0])
    low, high = (np.log([edge[k] for edge in box.values()]) for k in (0, 1))
    random = np.random.default_rng(seed)
    points = low + (high - low) * qmc.Sobol(len(box), seed=random).random(FIRST)
    judges = [plants[k] for k in _spread(plants)]
    known: list[tuple[float, tuple[float, ...]]] = []
    rounds = [None, *_SPREADS]
    for k, spread in enumerate(rounds):
        if spread is not None:
            if not known:
                break
            centres = np.array([known[j % min(_BEST, len(known))][1] for j in range(ROUND)])
            points = np.clip(centres + spread * random.standard_normal(centres.shape), low, high)
        known += _judged(kind, list(box), judges, wish, points)
        known = sorted(known)[: 4 * _BEST]
        if progress:
            progress(k + 1, len(rounds))
    for _, logs in known:  # all samples judge, the best law first
        law = law_of(kind, plants[0], dict(zip(box, _digits(np.exp(np.array(logs))), strict=True)))
        if float(margins(plants, law, wish.delay).sensitivity.max()) <= wish.most:
            return law
    raise InputError(
        f"no {kind} controller keeps the sensitivity below {wish.most:g} at all samples of the strip, measured "
        f"{wish.delay:g} s late; allow more, shorten the delay, or take another kind"
    )


def _digits(values: Array) -> list[float]:
    """Return gains with four digits, as one would write them."""
    return [float(f"{value:.4g}") for value in values]


def _spread(plants: list[Plant]) -> list[int]:
    """Return the nominal strip and those samples that are the most unlike it, in gain and speed."""
    if len(plants) <= _JUDGES:
        return list(range(len(plants)))
    about = np.array([0.3, 1.0, 3.0]) * float(np.abs(plants[0].poles.real).min())
    seen = np.log(responses(plants, np.append(about, np.abs(plants[0].poles).max())))
    parts = np.concatenate([seen.real, seen.imag], axis=1)
    parts = (parts - parts[0]) / (np.ptp(parts, axis=0) + 1e-300)
    chosen = [0]
    while len(chosen) < _JUDGES:  # each the farthest from those that are there
        apart = np.min([np.abs(parts - parts[k]).sum(axis=1) for k in chosen], axis=0)
        chosen.append(int(apart.argmax()))
    return chosen


def _judged(
    kind: str, names: list[str], plants: list[Plant], wish: Wish, points: Array
) -> list[tuple[float, tuple[float, ...]]]:
    """Return the robust ones of the laws at ``points``, logarithms of gains, and how far each is from the wish."""
    laws, kept, worst = [], [], []
    for logs in points:
        try:
            law = law_of(kind, plants[0], dict(zip(names, np.exp(logs).tolist(), strict=True)))
        except InputError:
            continue
        if not _plainly_robust(law, plants, wish):
            continue
        found = margins(plants, law, wish.delay, _POINTS)
        most = float(found.sensitivity.max())
        if most > wish.most * _INSIDE:
            continue
        missing = max(0.0, 1 - float(found.bandwidth[0]) / wish.bandwidth) if wish.bandwidth else 0.0
        laws.append(law)
        kept.append(logs)
        worst.append(most + 1e3 * missing)
    if not laws:
        return []
    settled, over = steps(plants[0], laws, wish)
    goal = wish.settling or wish.bound
    late = (
        np.maximum(settled / goal, 1.0) if wish.settling or wish.bandwidth is None else np.minimum(settled, 1e6) / 1e6
    )
    score = late + 20 * np.maximum(over - wish.overshoot * 0.97, 0) + 0.01 * np.array(worst)
    return [(float(value), tuple(logs.tolist())) for value, logs in zip(score, kept, strict=True) if np.isfinite(value)]


def _plainly_robust(law: Law, plants: list[Plant], wish: Wish) -> bool:
    """Return False for a law whose nominal loop is already too sensitive at few frequencies."""
    frequency = frequencies(plants[:1], law, _FEW)
    loop = plants[0].response(frequency) * law.response(frequency) * np.exp(-1j * frequency * wish.delay)
    return bool((np.abs(1 + loop) * wish.most >= 0.98).all())


def steps(plant: Plant, laws: list[Law], wish: Wish) -> tuple[Array, Array]:
    """Return settling times [s] and overshoots of many laws, sampled: near those of the continuous loop, and quick."""
    horizon = 4 * max(wish.bound, wish.settling or 0.0)
    width = horizon / _PERIODS
    late = round(wish.delay / width)
    s, n = len(plant.b), len(laws[0].out)
    moved = _held(plant.a[None], plant.b[None, :, None], width)
    ap, bp = moved[0][0], moved[1][0, :, 0]
    a = np.stack([law.a for law in laws])
    inputs = np.stack([np.stack([law.into_reference, law.into_measured, law.into_excess], axis=1) for law in laws])
    ac, bc = _held(a, inputs, width)
    out = np.stack([law.out for law in laws])
    direct = np.array([[law.reference, law.measured] for law in laws])
    x, z = np.zeros((len(laws), s)), np.zeros((len(laws), n))
    seen = np.zeros((_PERIODS + 1, len(laws)))
    excess_rows = bc[:, :, 2]
    fixed = bc[:, :, 0] * wish.step
    with np.errstate(all="ignore"):
        for k in range(_PERIODS):
            y = seen[k - late] if k >= late else np.zeros(len(laws))
            asked = (out * z).sum(axis=1) + direct[:, 0] * wish.step + direct[:, 1] * y
            applied = np.clip(asked, -wish.limit, wish.limit)
            z = (
                (ac @ z[:, :, None])[:, :, 0]
                + fixed
                + bc[:, :, 1] * y[:, None]
                + excess_rows * (applied - asked)[:, None]
            )
            x = x @ ap.T + applied[:, None] * bp
            seen[k + 1] = x @ plant.c
        off: Mask = ~(np.abs(seen - wish.step) <= BAND * abs(wish.step))
        over = np.maximum(np.nanmax(seen / wish.step, axis=0) - 1, 0.0)
    last = _PERIODS - np.argmax(off[::-1], axis=0)
    settled = np.where(off[-1], np.inf, (last + 1) * width)
    return settled, over


def _held(a: Array, b: Array, width: float) -> tuple[Array, Array]:
    """Return discrete systems (N, n, n), (N, n, m) of continuous ones whose inputs are held for ``width`` [s]."""
    n, m = b.shape[1:]
    whole = np.zeros((len(a), n + m, n + m))
    whole[:, :n, :n], whole[:, :n, n:] = a, b
    moved = expm(whole * width)
    return moved[:, :n, :n], moved[:, :n, n:]
