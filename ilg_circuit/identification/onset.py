"""Treats the onset as an unknown between two readings, and includes its uncertainty in the intervals.

A shift d of a step's onset is a factor exp(d/tau) on each branch of a linear port, so that the current of such a port
does not determine it; diffusion and the displacement do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..arrays import Array
from ..findings import Finding
from ..fit.bounded import BoundedProfile, matters, profile_bounded
from ..fit.criteria import structured
from ..fit.estimate import INTERVALS, Estimate
from ..fit.fitting import fit_near, with_starts
from ..fit.intervals import Uncertainties
from ..fit.observation import Observation
from ..fit.problem import Problem, Progress
from ..fit.quantiles import student
from ..fit.result import FitResult
from ..measurements.record import Channel
from .clock_profile import ClockProfile, Observe, beside, clocked
from .current import CurrentData
from .film import Moving
from .jumps import JumpErrors, errors_of, placed, too_many, unknown
from .motion import DisplacementData
from .observation_fit import ObservationFit
from .open_path import open_path
from .port_model import BRACKET, BY_TIME, Measured

#: Distance of an onset from the middle, relative to the admitted range, below which it is in the middle.
_MIDDLE = 1e-3


@dataclass(frozen=True, eq=False)
class OnsetProfile:
    """The profile of the onset of one file, whose current is ``channel``.

    Its places are shares of the bracket beyond the ``start``; several files may have one profile.
    """

    source: str
    channel: Channel
    profile: BoundedProfile
    start: float = 0.0

    @property
    def half(self) -> float:
        """Half-width of the admitted range of the onset [s]."""
        low, high = self.profile.admitted
        return self.channel.width * (high - low) / 2

    @property
    def estimate(self) -> Estimate:
        """The onset [s] in the file's time; its interval follows from the readings and the fit."""
        low, middle, high = (
            self.channel.zero + float(np.clip(self.start + share, *BRACKET)) * self.channel.width
            for share in (self.profile.admitted[0], self.profile.middle, self.profile.admitted[1])
        )
        return Estimate(middle, "s", (high - low) / np.sqrt(12), (low, high))

    def finding(self, fit: FitResult, errors: Array) -> Finding | None:
        """Return a finding if the onset adds to the uncertainty of parameters with standard ``errors`` (n,)."""
        felt = matters(self.profile, errors / fit.units)
        if not felt.any():
            return None
        ends = self.estimate.ci95
        assert ends is not None
        names = [label for label, yes in zip(fit.labels, felt, strict=True) if yes]
        code = "onset-bracketed" if self.channel.width else "jumps-bracketed"
        return Finding(code, self.source, {"from": ends[0], "to": ends[1], "parameters": names})


@dataclass(frozen=True)
class Onsets:
    """The profiles of all uncertain onsets, of clocks that were fitted, and of ``others``: electron paths not seen.

    ``jumps`` are what places of later jumps, or noise of a drive, add.
    """

    profiles: tuple[OnsetProfile, ...] = ()
    clocks: tuple[ClockProfile, ...] = ()
    jumps: tuple[JumpErrors, ...] = ()
    others: tuple[BoundedProfile, ...] = ()

    @property
    def every(self) -> tuple[BoundedProfile, ...]:
        onsets = {id(p.profile): p.profile for p in self.profiles}
        return (*onsets.values(), *(p for clock in self.clocks for p in clock.every), *self.others)

    def widened(self, fit: FitResult, found: Uncertainties) -> Uncertainties:
        """Return the estimates, every standard error and interval widened by the uncertainty of the onsets."""
        if not (self.every or self.jumps):
            return found
        reported = np.array([found.estimates[label].reported[0] for label in fit.labels])
        quantile = student(0.975, fit.freedom)
        more = self.reach(reported / fit.units, quantile, lambda x: x)
        spread = np.sqrt(np.diag(self.covariance(fit)))
        scales, estimates = fit.problem.scales, dict(found.estimates)
        for name in INTERVALS:
            ends = [getattr(found.estimates[label], name) for label in fit.labels]
            for side in (0, 1):
                at = np.array([v if e is None else e[side] for e, v in zip(ends, fit.values.tolist(), strict=True)])
                with np.errstate(divide="ignore"):
                    moved = scales.values(scales.coordinates(at) + (2 * side - 1) * more[side])
                moved = np.where(np.isfinite(at) & (at != 0), moved, at)
                ends = [
                    e if e is None else (x, e[1]) if not side else (e[0], x)
                    for e, x in zip(ends, moved.tolist(), strict=True)
                ]
            for label, interval in zip(fit.labels, ends, strict=True):
                estimates[label] = replace(estimates[label], **{name: interval})
        for label, extra in zip(fit.labels, spread.tolist(), strict=True):
            e = estimates[label]
            errors = (x and float(np.hypot(x, extra)) for x in (e.stderr, e.bootstrap, e.autoregression))
            stderr, bootstrap, autoregression = errors
            estimates[label] = replace(e, stderr=stderr, bootstrap=bootstrap, autoregression=autoregression)
        findings = [p.finding(fit, reported) for p in self.profiles]
        return replace(found, estimates=estimates, findings=(*found.findings, *(f for f in findings if f)))

    def reach(self, errors: Array, quantile: Array, of: Callable[[Array], Array]) -> Array:
        """Return the widening (2, m) of intervals below and above, by the uncertainty of the onsets.

        ``errors`` (m,), with Student's ``quantile`` (m,), are standard errors of quantities (g, m) that ``of`` computes
        from coordinates (g, n).
        """
        more = np.zeros((2, len(errors)))
        for each in self.every:  # several onsets may all be at the ends of their ranges
            more += np.maximum(np.array(each.of(of).reach(errors, quantile)) - quantile * errors, 0.0)
        if self.jumps:
            variances = sum(each.variances(of) for each in self.jumps)
            more += quantile * (np.sqrt(errors**2 + variances) - errors)
        return more

    def told(self, row: ObservationFit) -> ObservationFit:
        """Return a row with the intervals of its onset, delay and rate among its derived quantities."""
        told: dict[str, Estimate] = {}
        if row.quantity in BY_TIME:
            told = next(({"onset": p.estimate} for p in self.profiles if p.source == row.source), told)
        elif row.quantity == "displacement":
            told = next((clock.estimates for clock in self.clocks if clock.data.source == row.source), told)
        return replace(row, derived={**row.derived, **told})

    def covariance(self, fit: FitResult) -> Array:
        """Return the covariance (n, n) of the values due to onsets and jumps distributed over their ranges."""
        moves = [np.outer(p.range, p.range) / 12 for p in self.every]
        moves += [each.covariance for each in self.jumps]
        return np.asarray(sum(moves, np.zeros((len(fit.values),) * 2)) * np.outer(fit.units, fit.units))


def _at_shift(data: Measured, shift: float) -> Measured:
    """Return data with the onset ``shift`` parts of its bracket later, within it."""
    return data.at_share(float(np.clip(data.share + shift, *BRACKET)))


def _shifted(
    problem: Problem, data: Sequence[Measured], members: Sequence[int], observe: Observe, shift: float
) -> Problem:
    """Return the problem with other onsets for some ``members`` of its data."""
    parts = [_at_shift(d, shift) if k in members else d for k, d in enumerate(data)]
    pairs = zip(parts, problem.observations, strict=True)
    return replace(problem, observations=tuple(observe(d, o.sigma) for d, o in pairs))


def _bounds(shares: Sequence[float]) -> tuple[float, float]:
    """Return the bounds of a shift by which at least one of the ``shares`` stays within its bracket."""
    return BRACKET[0] - max(shares), BRACKET[1] - min(shares)


def _telling(members: Sequence[int], data: Sequence[Measured], found: FitResult) -> list[int]:
    """Return which observations of one file tell its onset: the current, and displacements that are noise."""
    channel = data[members[0]].channel
    # beginning within a run, what moved the strip before is not known: its displacement tells no time
    moving = members[1:] if channel is not None and channel.width else []
    return [members[0], *(k for k in moving if _tells_onset(data[k], found.residuals_of(k)))]


def settled(
    found: FitResult,
    data: Sequence[Measured],
    observe: Observe,
    *,
    rival: Observe | None = None,
    costly: bool = False,
    progress: Progress = None,
) -> tuple[FitResult, tuple[Measured, ...], Onsets]:
    """Return the fit with every onset in the middle of its admitted range, the data likewise, and the profiles.

    ``observe`` makes the observations of ``found`` from ``data`` and their sigmas, ``rival`` those of a displacement by
    another beam, where a delay of its clock might resemble inertia. The onset is determined by the
    current, and by the displacement if its residuals are noise. Raises SolveError if a fit fails.
    """
    profiles: list[OnsetProfile] = []
    moved = list(data)
    found, moved, left = _placed(found, moved, observe, progress)
    files: dict[str, list[int]] = {}
    for source in dict.fromkeys(d.source for d in data):
        members = [k for k, d in enumerate(data) if d.source == source]
        if moved[members[0]].channel is not None and moved[members[0]].bracketed:
            files[source] = members
    # files of one instrument may all have their onsets at the same place between two readings: they move together
    groups = [list(files)] if len(files) > 1 else [[source] for source in files]
    for group in groups:
        every = [k for source in group for k in files[source]]
        telling = [k for source in group for k in _telling(files[source], moved, found)]
        at = partial(_shifted, found.problem, tuple(moved), every, observe)
        profile = profile_bounded(found, at, _bounds([moved[k].share for k in every]), telling, costly=costly)
        low, high = profile.admitted
        starts = [moved[files[source][0]].share for source in group]
        if abs(profile.middle) > _MIDDLE * (high - low):
            found = with_starts(fit_near(at(profile.middle), found.values, progress), found.starts)
            moved = [_at_shift(d, profile.middle) if k in every else d for k, d in enumerate(moved)]
            profile = profile.knowing(profile.middle, found.coordinates)
        for source, start in zip(group, starts, strict=True):
            channel = moved[files[source][0]].channel
            assert channel is not None
            profiles.append(OnsetProfile(source, channel, profile, start))
    clocks: list[ClockProfile] = []
    for k, d in enumerate(moved):
        if not isinstance(d, DisplacementData) or d.delays is None:
            continue
        onset = next((p.half for p in profiles if p.source == d.source), 0.0)
        found, clock = clocked(found, k, observe, d, onset, costly, progress)
        if rival is not None:
            clock = beside(found, clock, k, rival, d, costly, progress)
        moved[k] = clock.data
        clocks.append(clock)
    errors = (errors_of(found, left),) if left.any() else ()
    path = open_path(found, moved, costly=costly)
    return found, tuple(moved), Onsets(tuple(profiles), tuple(clocks), errors, () if path is None else (path,))


def _placed(
    found: FitResult, data: Sequence[Measured], observe: Observe, progress: Progress
) -> tuple[FitResult, list[Measured], Array]:
    """Return the fit with jumps where the readings place them, the data, and what that leaves unknown (samples, j).

    The onsets of several files are placed together, too: each depends on the others'.
    """
    several = len({d.source for d in data if isinstance(d, CurrentData)}) > 1
    files = []
    for source in dict.fromkeys(d.source for d in data):
        members = [k for k, d in enumerate(data) if d.source == source]
        first = data[members[0]]
        if isinstance(first, CurrentData) and (
            unknown(first) or (several and first.onset_width and not too_many(first))
        ):
            files.append(([d for k in members if isinstance(d := data[k], CurrentData | DisplacementData)], members))
    if not files:
        return found, list(data), np.zeros((len(found.residuals), 0))
    sigmas = [o.sigma for o in found.problem.observations]

    def observed(k: int, d: CurrentData | DisplacementData) -> Observation:
        return observe(d, sigmas[k])

    place = partial(placed, found, files, observed, progress=progress)
    again, there, left = place()
    # residuals that are no noise yet may be so once the jumps are placed; if not, they place none
    telling = np.ones(len(found.residuals), dtype=bool)
    for of_file, at in there:
        for k, d in zip(at[1:], of_file[1:], strict=True):
            telling[found.problem.slices[k]] = _tells_onset(d, again.residuals_of(k))
    if not telling.all():
        again, there, left = place(telling)
    moved = list(data)
    for of_file, at in there:
        for k, d in zip(at, of_file, strict=True):
            moved[k] = d
    return again, moved, left


def _tells_onset(data: Measured, residuals: Array) -> bool:
    """Return True if a displacement determines the onset: its clock is known, and its residuals are noise."""
    return isinstance(data, DisplacementData) and data.delays is None and not structured(residuals)


def clock_findings(records: Sequence[Moving], onsets: Onsets) -> list[Finding]:
    """Return findings on clocks that may as well be a beam's inertia, or whose rate is assumed to be the voltage's."""
    told = {clock.data.source for clock in onsets.clocks if clock.rate is not None}
    found = [Finding("clock-or-inertia", clock.data.source) for clock in onsets.clocks if clock.alike]
    assumed = [d.source for d in records if d.record.own_clock and d.source not in told]
    return [*found, *(Finding("clock-rate-assumed", source) for source in assumed)]
