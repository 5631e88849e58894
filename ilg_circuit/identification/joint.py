"""The last step of an identification: one fit of all observations in one parameter space, judged by the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..fit.fitting import composed, fit
from ..fit.judge import MOST, Judgement, judged
from ..fit.observation import Observation
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..solve.transient import DEFAULT_ACCURACY
from ..strip.actuator import Actuator
from .clock_profile import Observe
from .coupling_fit import CouplingFit
from .current import CurrentData
from .motion import DisplacementData, Motion, port_matters
from .onset import Onsets, settled
from .port_fit import PortFit
from .port_model import Measured, PortData, PortModel, sigma_of

#: Finest and coarsest accuracy of an engine that judges a fit.
_JUDGED = (DEFAULT_ACCURACY, 1e-5)


@dataclass(frozen=True, eq=False)
class Joint:
    """The joint fit of all observations: currents and impedances in their order, then displacements.

    ``port`` and ``coupling`` are views of it, None without files for them; ``onsets`` are the profiles of uncertain
    onsets. ``judgement`` is an estimate of the difference to a fit by the engine of record, None if that engine was
    used. ``cheap`` are the labels of a port whose effects all have closed forms.
    """

    fit: FitResult
    port: PortFit | None
    coupling: CouplingFit | None
    onsets: Onsets
    judgement: Judgement | None
    cheap: tuple[str, ...]


def joined(
    port: PortFit | None,
    coupling: CouplingFit | None,
    actuator: Actuator,
    per_record: frozenset[str],
    progress: Progress = None,
) -> Joint:
    """Return the joint fit of all observations, started from the separate fits of port and coupling.

    Without an electrode resistance they share no parameter, and the joint fit consists of the separate ones. Raises
    SolveError if the joint fit or the engine fails.
    """
    together = port is not None and coupling is not None and port_matters(actuator, port.model)
    ports = port.data if port is not None else ()
    data: tuple[Measured, ...] = (*ports, *(coupling.data if coupling is not None else ()))
    motion = None if coupling is None else coupling.motion
    if port is not None and motion is not None and together:
        typical = tuple(port.values[name] for name in port.kind.names)
        motion = replace(motion, actuator=actuator, port=replace(port.model, typical=typical))
    observe = partial(_observation, None if port is None else port.model, motion)
    if port is not None and together:
        found = _fit_all(port, coupling, data, motion, per_record, progress)
    else:
        found = _composed(port, coupling)
    closed = all(d.closed(port.model) for d in ports) if port is not None else motion is not None and motion.linear
    costly = not closed or (together and motion is not None and not motion.linear)
    rival = _other_beam(coupling, motion, port)
    found, data, onsets = settled(found, data, observe, rival=rival, costly=costly, progress=progress)
    judgement = None
    if any(d.engine == "ngspice" for d in data) and closed:
        few = [d.trial() if isinstance(d, PortData) else d for d in data]
        observations = tuple(
            observe(d, o.sigma, accuracy=_telling(found, k, d))
            for k, (d, o) in enumerate(zip(few, found.problem.observations, strict=True))
        )
        record = replace(found.problem, observations=observations)
        found, judgement = judged(found, record, progress, _rows(data, few))
    labels = port.fit.labels if port is not None and port.kind.linear and not costly else ()
    port, coupling = _views(found, port, coupling, data, together)
    return Joint(found, port, coupling, onsets, judgement, labels)


def _other_beam(coupling: CouplingFit | None, motion: Motion | None, port: PortFit | None) -> Observe | None:
    """Return what predicts the one displacement by the other beam, where both predict in closed form."""
    if coupling is None or motion is None or not motion.linear or len(coupling.individual) > 1:
        return None
    beam = "static" if motion.beam == "dynamic" else "dynamic"
    return partial(_observation, None if port is None else port.model, replace(motion, beam=beam))


def _rows(data: Sequence[Measured], few: Sequence[Measured]) -> NDArray[np.intp] | None:
    """Return the indices of the samples of ``few`` among all samples, None if they are the same."""
    rows, start = [], 0
    for d, trial in zip(data, few, strict=True):
        if isinstance(d, CurrentData) and isinstance(trial, CurrentData):
            rows.append(start + np.searchsorted(d.rows, trial.rows))
        else:
            rows.append(start + np.arange(len(d.data)))
        start += len(d.data)
    return None if all(a is b for a, b in zip(data, few, strict=True)) else np.concatenate(rows)


def _telling(found: FitResult, k: int, data: Measured) -> float:
    """Return the accuracy of an engine that tells whether it would move a parameter of the fit.

    An error of one sign in all samples moves none by more of its standard error than the samples' root times its part
    of the residuals.
    """
    part = found.rms_of(k) / max(data.size, 1e-300)
    return float(np.clip(MOST * part / np.sqrt(len(data.data)), *_JUDGED))


def _observation(
    model: PortModel | None,
    motion: Motion | None,
    data: Measured,
    sigma: float | Array,
    *,
    accuracy: float | None = None,
) -> Observation:
    """Return the observation of ``data``, with an ``accuracy`` predicted by the engine of record."""
    of_record, reached = accuracy is not None, accuracy or DEFAULT_ACCURACY
    if isinstance(data, DisplacementData):
        assert motion is not None
        return data.observation(motion, sigma, of_record=of_record, accuracy=reached)
    assert isinstance(data, PortData)
    assert model is not None
    if isinstance(data, CurrentData) and of_record:
        data = replace(data, accuracy=reached)
    return data.observation(model, sigma, of_record=of_record)


def _composed(port: PortFit | None, coupling: CouplingFit | None) -> FitResult:
    """Return the joint fit composed of the independent fits of port and coupling."""
    if port is None:
        assert coupling is not None
        return coupling.fit
    if coupling is None:
        return port.fit
    problems = (port.fit.problem, coupling.fit.problem)
    problem = Problem(
        tuple(o for p in problems for o in p.observations),
        (*port.model.parameters, *coupling.motion.law.parameters),
        problems[0].per_record | problems[1].per_record,
        dict(problems[0].fixed),
    )
    return composed(problem, (*port.fit.parts, *coupling.fit.parts))


def _fit_all(
    port: PortFit,
    coupling: CouplingFit | None,
    data: Sequence[Measured],
    motion: Motion | None,
    per_record: frozenset[str],
    progress: Progress,
) -> FitResult:
    """Return the fit of currents and displacements that share the port's parameters."""
    assert coupling is not None
    assert motion is not None
    electrical = [sigma_of(i.fit, d.size) for d, i in zip(port.data, port.individual, strict=True)]
    sigmas = (*electrical, *coupling.sigmas())
    observations = tuple(_observation(port.model, motion, d, sigma) for d, sigma in zip(data, sigmas, strict=True))
    own = per_record | coupling.fit.problem.per_record
    problem = Problem(observations, motion.parameters, own, dict(port.fit.problem.fixed))
    known = {**port.fit.by_label(), **coupling.fit.by_label()}
    found = fit(problem, np.array([known[label] for label in problem.labels]), progress)
    return replace(found, starts=port.fit.starts)


def _views(
    found: FitResult,
    port: PortFit | None,
    coupling: CouplingFit | None,
    data: Sequence[Measured],
    together: bool,
) -> tuple[PortFit | None, CouplingFit | None]:
    """Return the views of port and coupling on the joint fit."""
    if port is None:
        return None, coupling and replace(coupling, fit=found)
    count, total = len(port.data), len(data)
    moved = tuple(d for d in data[:count] if isinstance(d, PortData))
    if together or coupling is None:
        port = replace(port, data=moved, fit=found)
        coupling = coupling and replace(coupling, fit=found)
        return port, coupling
    electrical = composed(found.problem.of(range(count)), found.parts)
    mechanical = composed(found.problem.of(range(count, total)), found.parts)
    port = replace(port, data=moved, fit=replace(electrical, starts=port.fit.starts))
    coupling = replace(coupling, fit=replace(mechanical, starts=coupling.fit.starts))
    return port, coupling
