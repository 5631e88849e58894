"""Computes what files that do not have one port add to the errors of their common parameters.

The joint fit's errors are those of one strip in one state. Where the files were measured on another strip each, or on
one in other states, the common value is a mean of theirs: its interval reaches over the files' own intervals, and the
strip's covariance holds the scatter between the files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Array
from ..fit.estimate import INTERVALS, Estimate
from ..fit.quantiles import student
from ..fit.reported import reported_covariance, reported_freedom
from ..fit.result import FitResult
from ..strip.actuator import Uncertainty
from .observation_fit import ObservationFit
from .port_fit import PortFit


@dataclass(frozen=True)
class Scatter:
    """The scatter of parameters between files, of those whose own intervals do not hold the common value.

    ``deviations`` (files, parameters) are the logarithms of their values less the common ones, 0 where the interval
    holds that; ``ends`` (parameters, 2) are the lowest and highest ends of such intervals. Empty without any.
    """

    names: tuple[str, ...]
    deviations: Array
    ends: Array

    def __bool__(self) -> bool:
        """Return True if there is any."""
        return bool(self.deviations.any())

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the logarithms between the files, about the common values."""
        return self.deviations.T @ self.deviations / max(len(self.deviations), 1)

    def added(self, found: Uncertainty) -> Uncertainty:
        """Return a strip's covariance with the scatter in it."""
        at = [found.names.index(name) for name in self.names]
        covariance = np.array(found.covariance)
        covariance[np.ix_(at, at)] += self.covariance
        return replace(found, covariance=tuple(map(tuple, covariance.tolist())))

    def widened(self, found: Mapping[str, Estimate]) -> dict[str, Estimate]:
        """Return estimates whose intervals reach over those of the files, and whose errors hold the scatter."""
        spread = np.sqrt(np.diag(self.covariance)).tolist()
        widened = dict(found)
        for name, size, (low, high) in zip(self.names, spread, self.ends.tolist(), strict=True):
            if not size:
                continue
            e = found[name]
            errors = (x and float(np.hypot(x, size * e.value)) for x in (e.stderr, e.bootstrap, e.autoregression))
            stderr, bootstrap, autoregression = errors
            known = {of: getattr(e, of) for of in INTERVALS}
            ends: dict[str, Any] = {of: x and (min(x[0], low), max(x[1], high)) for of, x in known.items()}
            widened[name] = replace(e, stderr=stderr, bootstrap=bootstrap, autoregression=autoregression, **ends)
        return widened


def between_files(port: PortFit | None, fit: FitResult, rows: Sequence[ObservationFit]) -> Scatter:
    """Return the scatter between the files of a port that does not hold for all of them, by the joint ``fit``."""
    names = tuple(name for name in _shared(port, fit)) if port is not None else ()
    none = Scatter((), np.zeros((0, 0)), np.zeros((0, 2)))
    if port is None or not names or not any(r.inconsistent for r in rows if r.quantity != "displacement"):
        return none
    deviations, ends = [], []
    for individual in port.individual:
        own, there = individual.fit, {name: k for k, name in enumerate(individual.fit.labels)}
        errors = student(0.975, reported_freedom(own)) * np.sqrt(np.diag(reported_covariance(own))) / own.values
        same = individual.model.kind.name == port.kind.name
        off, reach = np.zeros(len(names)), np.array([fit.means[name] for name in names])[:, None].repeat(2, axis=1)
        for k, name in enumerate(names):
            at = there.get(name)
            if not same or at is None:
                continue
            off[k] = np.log(own.values[at] / fit.means[name])
            with np.errstate(over="ignore"):
                reach[k] = own.values[at] * np.exp([-errors[at], errors[at]])
            if abs(off[k]) <= errors[at]:
                off[k], reach[k] = 0.0, fit.means[name]
        deviations.append(off)
        ends.append(reach)
    every = np.array(ends)
    return Scatter(names, np.array(deviations), np.column_stack([every[:, :, 0].min(0), every[:, :, 1].max(0)]))


def _shared(port: PortFit, fit: FitResult) -> Iterable[str]:
    """Yield the port's fitted parameters that all files share."""
    return (n for n in port.model.names if n not in port.fixed and n in fit.means and n not in fit.problem.per_record)
