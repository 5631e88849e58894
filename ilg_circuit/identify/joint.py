"""The last step of an identification: one fit of all observations in one parameter space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..fit.fitting import composed, fit
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..strip.actuator import Actuator
from .coupling_fit import CouplingFit
from .motion import COUPLING, Motion, port_matters
from .port_fit import PortFit
from .port_model import port_problem, sigma_of


def joined(
    port: PortFit,
    coupling: CouplingFit | None,
    actuator: Actuator,
    per_record: frozenset[str],
    progress: Progress = None,
) -> FitResult:
    """Return the fit of all observations: currents and impedances in their order, then displacements.

    Without an electrode resistance port and coupling share no parameter, and their fits are those of the components;
    with one they are fitted together, from where they ended by themselves. Raises SolveError where the common fit
    fails.
    """
    if coupling is None:
        return port.fit
    if not port_matters(actuator, port.model):
        parts = (*port.fit.parts, *coupling.fit.parts)
        observations = (*port.fit.problem.observations, *coupling.fit.problem.observations)
        parameters = (*port.model.parameters, *COUPLING)
        return composed(Problem(observations, parameters, per_record, dict(port.fit.problem.fixed)), parts)
    typical = tuple(port.values[name] for name in port.kind.names)
    motion = Motion(actuator, coupling.motion.beam, coupling.motion.engine, replace(port.model, typical=typical))
    sigmas = tuple(sigma_of(i.fit, d.size) for d, i in zip(port.data, port.individual, strict=True))
    electrical = port_problem(port.data, port.model, sigmas).observations
    pairs = zip(coupling.data, coupling.sigmas(), strict=True)
    mechanical = tuple(d.observation(motion, sigma) for d, sigma in pairs)
    problem = Problem((*electrical, *mechanical), motion.parameters, per_record, dict(port.fit.problem.fixed))
    known = {**port.fit.by_label(), **coupling.fit.by_label()}
    found = fit(problem, np.array([known[label] for label in problem.labels]), progress)
    return replace(found, starts=port.fit.starts)
