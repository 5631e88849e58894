"""Fits a model to one record's current, from several starts, with its jumps placed and its electron path open or not.

Jumps begin where a simpler model's fit has them; from rough places a model of more relaxations than there are does not
lead to them.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..errors import SolveError
from ..fit.bounded import likeliest
from ..fit.fitting import fit_near, with_starts
from ..fit.problem import Progress
from ..strip.models import ElectricalModel, electrical_model
from .current import CurrentData
from .current_search import fit_from_several, search_starts
from .jump_start import placing_models
from .jumps import FAR_BEHIND, placed, unknown
from .open_path import UNSEEN_PATH, conductance_error, seen_or_open
from .port_model import ANY_LADDER, BRACKET, DC, IndividualFit, PortModel, port_problem

#: Largest number of rows of a search for the onset.
_ONSET_ROWS = 400
#: Error of an engine's transient, relative to the largest current, in a fit that only selects the best start.
_ROUGH_ACCURACY = 1e-3
#: Largest number of evaluations of a nonlinear model's fit from where a search ended.
_MOST_EVALUATIONS = 60


def fit_alone(data: CurrentData, kind: ElectricalModel, held: float, progress: Progress) -> IndividualFit:
    """Return the fit of one record's current by a model, Re ``held`` [ohm], its later jumps in places.

    An electron path that the record does not show is an open circuit in it. Raises InputError or SolveError if the
    data do not determine the model.
    """
    if not data.may_be_open(kind):
        return _fitted(data, PortModel(kind, held), progress)
    found = seen_or_open(
        lambda opened: _fitted(data, PortModel(kind, held, opened=opened), progress),
        lambda found: found.fit,
        likely=data.opened,
        hopeless=unknown(data),  # beside jumps that a simpler model has placed
    )
    if not found.model.opened:
        return found
    return _with_path(found, data.rival, progress) or replace(found, fixed={DC: UNSEEN_PATH})


def _with_path(found: IndividualFit, rival: float, progress: Progress) -> IndividualFit | None:
    """Return the closer fit with an electron path from where one without ended, if there is one.

    Its jumps are placed unless it would stay much further away than a ``rival`` [A].
    """
    data, model = found.data, replace(found.model, opened=False)
    assert isinstance(data, CurrentData)
    start, error = found.model.every(found.fit.values), conductance_error(found.fit)
    if not error > 0:  # an exact record
        return None
    start[model.names.index(DC)] = 1 / error
    with suppress(SolveError):
        again = fit_near(port_problem((data,), model, (1.0,)), start, progress, _MOST_EVALUATIONS)
        if again.rms_of(0) < found.rms:
            closer = IndividualFit(data, model, with_starts(again, found.fit.starts))
            return _with_jumps(replace(data, rival=rival), closer, progress) if unknown(data) else closer
    return None


def _fitted(data: CurrentData, model: PortModel, progress: Progress) -> IndividualFit:
    """Return the fit of a model, its jumps in places."""
    if not unknown(data) or data.places:
        return _from_places(data, model, progress)
    return _by_simpler(data, model, progress) or _from_places(data.roughly_placed(), model, progress)


def _by_simpler(data: CurrentData, model: PortModel, progress: Progress) -> IndividualFit | None:
    """Return the fit that begins with the drive's jumps where a simpler model's fit has them, None without one.

    Where it has no minimum there, jumps begin where one relaxation places them. A model contains simpler ones, so
    that a fit from there which leaves much more than theirs has them in wrong places: then the error is raised.
    """
    for simpler in placing_models(model.kind):
        try:
            closer = _fitted(replace(data, rival=math.inf), replace(model, kind=electrical_model(simpler)), progress)
        except SolveError:
            continue
        assert isinstance(closer.data, CurrentData)
        try:
            return _from_places(replace(closer.data, rival=data.rival), model, progress)
        except SolveError:
            found = _from_places(data.roughly_placed(), model, progress)
            if found.rms > FAR_BEHIND * closer.rms:
                raise
            return found
    return None


def _from_places(data: CurrentData, model: PortModel, progress: Progress) -> IndividualFit:
    """Return the fit that begins with the jumps where they are."""
    first = _individual(data, model, progress)
    if not unknown(data):
        return first
    found = _with_jumps(data, first, progress)
    assert isinstance(found.data, CurrentData)
    if FAR_BEHIND * data.rival < found.rms:
        return found
    moved, values = _at_likely_onset(found.data, found.model, found.fit.values, progress)
    if moved is found.data:
        return found
    again = fit_near(port_problem((moved,), found.model, (1.0,)), values, progress)
    return IndividualFit(moved, found.model, with_starts(again, found.fit.starts))


def _at_likely_onset(
    data: CurrentData, model: PortModel, values: Array, progress: Progress
) -> tuple[CurrentData, Array]:
    """Return the data at the onset that few of its rows tell, and the values (n,) there; without a ladder the same.

    A ladder's current determines the onset; a sum of exponentials does not, and the onset stays in the middle.
    """
    if not (data.bracketed and model.kind.linear and model.port(model.every(values), ANY_LADDER).ladder is not None):
        return data, values
    few = data.some_rows(_ONSET_ROWS)
    near = fit_near(port_problem((few,), model, (1.0,)), values, progress)
    share = likeliest(near, lambda x: port_problem((few.at_share(x),), model, (1.0,)), BRACKET)
    return (data.at_share(share) if share else data), near.values


def _with_jumps(data: CurrentData, found: IndividualFit, progress: Progress) -> IndividualFit:
    """Return the fit with the drive's later jumps where the current places them."""
    files = [((data,), (0,))]
    placing, ((moved, _),), _ = placed(
        found.fit, files, lambda _, d: d.observation(found.model), progress=progress, rival=data.rival
    )
    return IndividualFit(replace(moved[0], rival=math.inf), found.model, placing)


def _individual(data: CurrentData, model: PortModel, progress: Progress) -> IndividualFit:
    """Return the fit from several starts, with jumps in unknown places where they are."""
    kind = model.kind
    start = data.start(kind, model.held or 0.0)
    model, start = replace(model, typical=tuple(start.tolist())), model.fitted(start)
    problem = port_problem((data,), model, (1.0,))
    if not data.closed(model):
        cheap = port_problem((replace(data, accuracy=_ROUGH_ACCURACY),), model, (1.0,))
        found = fit_from_several(problem, replace(cheap, rough=True), start, progress)
        return IndividualFit(data, model, found)
    # multi-start with few samples, then the fit of all
    values, starts, check = search_starts(problem, lambda at: data.without_engine(model, at), data.since, start)
    model, moved = replace(model, typical=tuple(model.every(values).tolist())), data
    if not unknown(data):  # else its jumps are yet to be placed
        moved, values = _at_likely_onset(data, model, values, progress)
    problem = port_problem((moved,), model, (1.0,))
    most = None if kind.linear else _MOST_EVALUATIONS
    found = fit_near(problem, values, progress, most)
    every = model.every(found.values)
    ordered = model.fitted(every[kind.order(every)])
    if not np.array_equal(ordered, found.values):
        found = fit_near(problem, ordered, progress, most)
    if not unknown(data):  # else few samples lie elsewhere beside the jumps, as they do beside another onset
        check(found.values if moved is data else values)
    return IndividualFit(moved, model, with_starts(found, starts))
