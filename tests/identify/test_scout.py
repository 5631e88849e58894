"""Many starts: the answer does not depend on one of them, and the result says how many agreed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic import record, step, two_branches

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import SolveError
from ilg_circuit.fit.least_squares import fit_circuit
from ilg_circuit.identify import current, identify
from ilg_circuit.identify.current import fit_current
from ilg_circuit.identify.scout import fit_from_several, scout
from ilg_circuit.strip.actuator import PAPER

Array = NDArray[np.float64]
T = np.linspace(0.0, 5.0, 100)


@pytest.mark.parametrize("model", ["rc2", "warburg"])
def test_a_start_that_is_tens_of_times_off_leads_to_the_same_answer(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    m = record(step(), 300.0, 151, strip=two_branches(), noise=2e-3, seed=8).measurement()
    expected = fit_current(m, 0.0, model, "exact")
    factors = np.array([5.0, 0.1, 20.0, 3.0, 0.2])[: len(expected.fit.values)]
    monkeypatch.setattr(current, "model_start", lambda *_: expected.fit.values * factors)
    found = fit_current(m, 0.0, model, "exact")
    assert (np.abs(found.fit.values - expected.fit.values) < 0.05 * expected.fit.errors).all()
    assert found.scouting.agreeing >= 2


def test_starts_are_told() -> None:
    r = record(step(), 300.0, 151, noise=2e-3, seed=9)
    s = identify(r.measurement(), base=PAPER, model="rc", engine="exact").to_json()["statistics"]
    assert 2 <= s["starts_agreeing"] <= s["starts"]
    assert s["relative_offset"] < 1e-2


def test_a_fit_elsewhere_than_the_best_start_is_refused() -> None:
    m = record(step(), 300.0, 151, noise=2e-3, seed=10).measurement()
    fit = fit_current(m, 0.0, "rc", "exact").fit

    def ports(values: Array) -> list[current.Port]:
        return [current.electrical_model("rc").port(v) for v in values.tolist()]

    _, check = scout(fit.problem, ports, m.drive, m.current.time, fit.values)
    check(fit.values)
    with pytest.raises(SolveError, match="did not come back"):
        check(fit.values * 1.2)


def test_without_a_closed_form_a_few_fits_stand_in() -> None:
    data = np.sin(2 * T) + 0.01 * np.random.default_rng(0).standard_normal(len(T))
    problem = fit_circuit(lambda v: np.sin(v * T), data, ("frequency",), np.array([2.1])).problem
    scouting, fit = fit_from_several(problem, np.array([2.3]), None)
    assert fit.values[0] == pytest.approx(2.0, abs=4 * float(fit.errors[0]))
    assert scouting.starts == 3
    hopeless = replace(problem, data=np.exp(T))
    with pytest.raises(SolveError):
        fit_from_several(replace(hopeless, model=lambda v: v * 0.0 + np.ones_like(T)), np.array([2.3]), None)


def test_a_nonlinear_model_under_several_levels() -> None:
    times = np.repeat(np.arange(0.0, 60.0, 20.0), 2)[1:]
    drive = PiecewiseLinear(times, np.repeat([0.5, 2.0, -1.0], 2)[:-1])
    strip = replace(PAPER, material=replace(PAPER.material, emission_voltage=0.8))
    found = fit_current(record(drive, 60.0, 61, strip=strip, noise=1e-3, seed=2).measurement(), 0.0, "rc+sinh")
    assert found.scouting.agreeing >= 2
    assert found.fit.values[-1] == pytest.approx(0.8, abs=4 * float(found.fit.errors[-1]))
