"""Many starts: the answer does not depend on one of them, and the result says how many agreed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic import current_data, fit_current, record, step, two_branches

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import SolveError
from ilg_circuit.fit.fitting import fit_data
from ilg_circuit.fit.minimise import Run
from ilg_circuit.fit.multistart import StartSummary, gather, search
from ilg_circuit.identification import current
from ilg_circuit.identification.current_search import fit_from_several, search_starts
from ilg_circuit.identification.displacement_findings import start_findings
from ilg_circuit.identification.port_model import PortModel, port_problem
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.models import electrical_model

Array = NDArray[np.float64]
T = np.linspace(0.0, 5.0, 100)


@pytest.mark.parametrize("model", ["rc2", "warburg"])
def test_a_start_that_is_tens_of_times_off_leads_to_the_same_answer(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    r = record(step(), 300.0, 151, strip=two_branches(), noise=2e-3, seed=8)
    expected = fit_current(r, model, engine="exact").fit
    factors = np.array([5.0, 0.1, 20.0, 3.0, 0.2])[: len(expected.values)]
    monkeypatch.setattr(current, "model_start", lambda *_: expected.values * factors)
    found = fit_current(r, model, engine="exact").fit
    assert (np.abs(found.values - expected.values) < 0.05 * expected.errors).all()
    assert found.starts.agreeing >= 2


@pytest.mark.parametrize("best", [0.0, 1e-32])
def test_runs_that_differ_by_rounding_alone_reached_the_same_minimum(best: float) -> None:
    ends = [best, 8e-32, 1e-3]
    found = gather([Run(np.ones(3), squares, 0.0, 1.0) for squares in ends], rounding=1e-22)
    assert (found.agreeing, found.near(1e-5)) == (2, 2)


def test_a_fit_elsewhere_than_the_best_start_is_refused() -> None:
    data = current_data(record(step(), 300.0, 151, noise=2e-3, seed=10), "exact")
    found = fit_current(data.record, engine="exact").fit
    model = PortModel(electrical_model("rc"), 0.0, tuple(found.values.tolist()))
    problem = port_problem((data,), model, (1.0,))
    _, _, check = search_starts(problem, lambda t: data.without_engine(model, t), data.since, found.values)
    check(found.values)
    with pytest.raises(SolveError, match="did not return"):
        check(found.values * 1.2)


def test_without_a_closed_form_a_few_fits_stand_in() -> None:
    data = np.sin(2 * T) + 0.01 * np.random.default_rng(0).standard_normal(len(T))
    problem = fit_data(lambda v: np.sin(v * T), data, ("frequency",), np.array([2.1])).problem
    found = fit_from_several(problem, replace(problem, rough=True), np.array([2.3]), None)
    assert found.values[0] == pytest.approx(2.0, abs=4 * float(found.errors[0]))
    assert found.starts.starts == 3
    flat = problem.predicting([lambda v: v * 0.0 + np.ones_like(T)])
    for rough in (flat, problem):
        with pytest.raises(SolveError):
            fit_from_several(flat, rough, np.array([2.3]), None)


def test_a_nonlinear_model_under_several_levels() -> None:
    times = np.repeat(np.arange(0.0, 60.0, 20.0), 2)[1:]
    drive = PiecewiseLinear(times, np.repeat([0.5, 2.0, -1.0], 2)[:-1])
    strip = replace(PAPER, material=replace(PAPER.material, emission_voltage=0.8))
    found = fit_current(record(drive, 60.0, 61, strip=strip, noise=1e-3, seed=2), "rc+sinh").fit
    assert found.starts.agreeing >= 2
    assert found.values[-1] == pytest.approx(0.8, abs=4 * float(found.errors[-1]))


def test_a_best_minimum_reached_once_is_said() -> None:
    """A double well: descents end on either side, and the deeper one counts only if two of them met there."""
    found = search(
        lambda p: np.array([p[0] ** 2 - 1, 0.1 * (p[0] - 1)]),
        lambda p: np.array([[2 * p[0]], [0.1]]),
        [np.array([x]) for x in (-2.0, -1.5, 2.0)],
    )
    assert found.best.parameters[0] == pytest.approx(1.0)
    assert found.agreeing == 1
    assert not StartSummary(len(found.runs), found.agreeing).confirmed
    (finding,) = start_findings(StartSummary(3, 1))
    assert finding.code == "start-not-confirmed"
    assert start_findings(StartSummary(3, 2)) == start_findings(StartSummary()) == []
