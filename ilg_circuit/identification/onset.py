"""The onset as an unknown: it lies somewhere between two readings, and what depends on it has that in its interval.

A shift d of a step's onset is a factor exp(d/tau) on each branch of a linear port, so that a current alone never tells
it; diffusion and the displacement do.
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
from ..fit.estimate import Estimate
from ..fit.fitting import fit_near, with_starts
from ..fit.intervals import Uncertainties
from ..fit.observation import Observation
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..measurements.record import Channel
from .motion import DisplacementData
from .observation_fit import ObservationFit
from .port_model import BRACKET, Measured

#: Data and the unit of their residuals -> the observation that a model predicts.
Observe = Callable[[Measured, float | Array], Observation]
#: A delay is profiled within this part of its bounds about where the first fits found it.
_NEAR = 0.15
#: An onset nearer to the middle than this part of what is admitted is in the middle.
_MIDDLE = 1e-3


@dataclass(frozen=True, eq=False)
class OnsetProfile:
    """The profile of the onset of one file, whose current is ``channel``; its places are shares of the bracket."""

    source: str
    channel: Channel
    profile: BoundedProfile

    @property
    def estimate(self) -> Estimate:
        """The onset [s] in the file's time; its interval is what the readings, and the fit, leave open."""
        low, middle, high = (
            self.channel.zero + share * self.channel.width
            for share in (self.profile.admitted[0], self.profile.middle, self.profile.admitted[1])
        )
        return Estimate(middle, "s", (high - low) / np.sqrt(12), (low, high))

    def finding(self, fit: FitResult, errors: Array) -> Finding | None:
        """Return what the onset leaves open of the parameters, if anything, beside their standard ``errors`` (n,)."""
        felt = matters(self.profile, errors / fit.units)
        if not felt.any():
            return None
        ends = self.estimate.ci95
        assert ends is not None
        names = [label for label, yes in zip(fit.labels, felt, strict=True) if yes]
        code = "onset-bracketed" if self.channel.width else "jumps-bracketed"
        return Finding(code, self.source, {"from": ends[0], "to": ends[1], "parameters": names})


@dataclass(frozen=True, eq=False)
class DelayProfile:
    """The profile of the delay [s] of one file's displacement."""

    source: str
    profile: BoundedProfile

    @property
    def estimate(self) -> Estimate:
        """The delay [s]; its interval is what the fit leaves open."""
        low, high = self.profile.admitted
        return Estimate(self.profile.middle, "s", (high - low) / 3.92, (low, high))


@dataclass(frozen=True)
class Onsets:
    """The profiles of all files whose readings leave the onset open, and of delays that were fitted."""

    profiles: tuple[OnsetProfile, ...] = ()
    delays: tuple[DelayProfile, ...] = ()

    @property
    def every(self) -> tuple[BoundedProfile, ...]:
        return (*(p.profile for p in self.profiles), *(p.profile for p in self.delays))

    def widened(self, fit: FitResult, found: Uncertainties) -> Uncertainties:
        """Return the estimates with what the onsets leave open in every standard error and interval."""
        from scipy.stats import t as student

        if not self.every:
            return found
        reported = np.array([found.estimates[label].reported[0] for label in fit.labels])
        quantile = student.ppf(0.975, fit.freedom)
        more = self.reach(reported / fit.units, quantile, lambda x: x)
        spread = np.sqrt(np.diag(self.covariance(fit)))
        scales, estimates = fit.problem.scales, dict(found.estimates)
        for name in ("ci95", "ci95_bootstrap", "ci95_autoregression", "ci95_profile", "ci95_mcmc"):
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
        """Return how much further (2, m) intervals reach below and above, by what the onsets leave open.

        ``errors`` (m,), with Student's ``quantile`` (m,), are those of quantities that ``of`` makes (g, m) of
        coordinates (g, n).
        """
        more = np.zeros((2, len(errors)))
        for each in self.every:  # several onsets may all lie at their ends
            more += np.maximum(np.array(each.of(of).reach(errors, quantile)) - quantile * errors, 0.0)
        return more

    def told(self, row: ObservationFit) -> ObservationFit:
        """Return a row with the intervals of its onset and delay among its derived quantities."""
        name, profiles = ("onset", self.profiles) if row.quantity == "current" else ("displacement_delay", self.delays)
        estimates = {p.source: p.estimate for p in profiles}
        if row.quantity == "impedance" or row.source not in estimates:
            return row
        return replace(row, derived={**row.derived, name: estimates[row.source]})

    def covariance(self, fit: FitResult) -> Array:
        """Return the covariance (n, n) of the values by onsets anywhere in what is admitted."""
        moves = [p.range * fit.units for p in self.every]
        return sum((np.outer(m, m) / 12 for m in moves), np.zeros((len(fit.values),) * 2))


def _with_share(
    problem: Problem, data: Sequence[Measured], members: Sequence[int], observe: Observe, share: float
) -> Problem:
    """Return the problem with the onset of some ``members`` of its data elsewhere."""
    parts = [d.at_share(share) if k in members else d for k, d in enumerate(data)]
    pairs = zip(parts, problem.observations, strict=True)
    return replace(problem, observations=tuple(observe(d, o.sigma) for d, o in pairs))


def _with_delay(problem: Problem, data: Sequence[Measured], k: int, observe: Observe, delay: float) -> Problem:
    """Return the problem with another delay of the displacement ``k`` of its data."""
    d = data[k]
    assert isinstance(d, DisplacementData)
    observations = list(problem.observations)
    observations[k] = observe(d.at_delay(delay), observations[k].sigma)
    return replace(problem, observations=tuple(observations))


def settled(
    found: FitResult,
    data: Sequence[Measured],
    observe: Observe,
    *,
    costly: bool = False,
    progress: Progress = None,
) -> tuple[FitResult, tuple[Measured, ...], Onsets]:
    """Return the fit with every onset in the middle of what the data admit, the data so moved, and the profiles.

    ``data`` are those of the observations of ``found``, which ``observe`` makes of them and their sigmas. The current
    tells an onset; the displacement does where its residuals are noise. Raises SolveError where a fit fails.
    """
    profiles: list[OnsetProfile] = []
    moved = list(data)
    for source in dict.fromkeys(d.source for d in data):
        members = [k for k, d in enumerate(data) if d.source == source]
        current = moved[members[0]]
        if current.channel is None or not current.bracketed:
            continue

        at = partial(_with_share, found.problem, tuple(moved), members, observe)
        telling = [k for k in members if k == members[0] or not structured(found.residuals_of(k))]
        profile = profile_bounded(found, at, BRACKET, telling, start=current.share, costly=costly)
        low, high = profile.admitted
        if abs(profile.middle - current.share) > _MIDDLE * (high - low):
            moved = [d.at_share(profile.middle) if k in members else d for k, d in enumerate(moved)]
            found = with_starts(fit_near(at(profile.middle), found.values, progress), found.starts)
            profile = profile.knowing(profile.middle, found.coordinates)
        profiles.append(OnsetProfile(source, current.channel, profile))
    delays: list[DelayProfile] = []
    for k, d in enumerate(moved):
        if not isinstance(d, DisplacementData) or d.delays is None:
            continue
        behind = partial(_with_delay, found.problem, tuple(moved), k, observe)
        low, high = d.delays
        near = (max(low, d.delay - _NEAR * (high - low)), min(high, d.delay + _NEAR * (high - low)))
        tried = profile_bounded(found, behind, near, (k,), start=d.delay, costly=costly)
        moved[k] = d.at_delay(tried.middle)
        found = with_starts(fit_near(behind(tried.middle), found.values, progress), found.starts)
        delays.append(DelayProfile(d.source, tried.knowing(tried.middle, found.coordinates)))
    return found, tuple(moved), Onsets(tuple(profiles), tuple(delays))
