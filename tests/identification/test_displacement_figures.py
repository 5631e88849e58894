"""Figures called measured are the readings' own, and a drift is no more than the rest before the onset supports."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from synthetic import Synthetic, current_data, record, step

from ilg_circuit.findings import Finding
from ilg_circuit.fit import fitting
from ilg_circuit.fit.problem import Problem
from ilg_circuit.identification import Identification, identify
from ilg_circuit.identification.displacement import DisplacementFit, fit_displacement
from ilg_circuit.identification.displacement_metrics import DisplacementMetrics, displacement_metrics
from ilg_circuit.identification.motion import DisplacementData
from ilg_circuit.identification.motion_laws import EC31
from ilg_circuit.measurements.record import Channel
from ilg_circuit.report.displacement_metrics import metrics_lines
from ilg_circuit.solve.transient import DEFAULT_ACCURACY
from ilg_circuit.strip.actuator import PAPER

Array = NDArray[np.float64]

#: White noise of the made readings [m].
NOISE = 1e-6
#: Bends fast, falls back, creeps or comes back: what a straight line beside d(s) once took in.
SHAPES: dict[str, Callable[[Array], Array]] = {
    "creeps as a root": lambda t: 1e-3 * (1 - np.exp(-t / 0.3)) - 5e-4 * (1 - np.exp(-t / 4)) - 1.2e-4 * np.sqrt(t),
    "comes back": lambda t: 1.7e-3 * (1 - np.exp(-t / 0.2)) - 4e-4 * (1 - np.exp(-t / 2)) - 3e-3 / (1 + np.exp(70 - t)),
    "turns": lambda t: 1e-3 * (0.7 - np.exp(-t / 0.5) + 0.3 * np.exp(-t / 3)) * np.cos(t / 25),
}


def made(shape: Callable[[Array], Array], rest: float, seed: int = 1, drift: float = 0.0) -> Synthetic:
    """A record of 120 s whose displacement has that shape after ``rest`` [s] at 8 mm, every 0.2 s."""
    r = record(step(2.0), 120.0, 601, rest=round(5 * rest), displacement=True)
    t = r.columns["time"] - rest
    moved = np.where(t >= 0, shape(np.maximum(t, 0.0)), 0.0)
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(t))
    return r.changed(displacement=8e-3 + moved + drift * t + noise)


@functools.cache
def of_shape(shape: str, rest: float) -> tuple[Synthetic, DisplacementFit]:
    r = made(SHAPES[shape], rest)
    return r, fitted(r)


def fitted(r: Synthetic) -> DisplacementFit:
    return fit_displacement(current_data(r, "exact"), PAPER)


def figures(fit: DisplacementFit) -> DisplacementMetrics:
    found = displacement_metrics(fit)
    assert found is not None
    return found


def by_code(fit: DisplacementFit) -> dict[str, Finding]:
    return {finding.code: finding for finding in fit.findings}


# -- measured means measured -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rest", [2.0, 20.0])
@pytest.mark.parametrize("shape", SHAPES)
def test_measured_figures_are_the_readings_less_the_rest_position(shape: str, rest: float) -> None:
    r, fit = of_shape(shape, rest)
    found = figures(fit)
    t, moved = r.columns["time"] - rest, fit.data.sign * (r.columns["displacement"] - 8e-3)
    assert fit.rest == pytest.approx(8e-3, abs=2 * NOISE)
    for part, until in ((found.measured, found.until), (found.record or found.measured, found.record_until)):
        inside = (t >= 0) & (t <= until + 1e-9)
        last = inside & (t >= 0.95 * until)
        assert part.final == pytest.approx(moved[last].mean(), abs=3 * NOISE)
        low, high = moved[inside].min(), moved[inside].max()
        # a cubic through a peak of few samples may stand over them by half a percent
        assert low - 0.01 * (high - low) <= part.peak <= high + 0.01 * (high - low)
        assert abs(part.peak) == pytest.approx(max(-low, high), abs=0.02 * (high - low))
        assert part.back_relaxation <= 1.02 * (high - low)
    assert found.record_until == pytest.approx(120.0)


@pytest.mark.parametrize("shape", SHAPES)
def test_what_d_s_does_not_describe_is_misfit_with_its_window(shape: str) -> None:
    r, fit = of_shape(shape, 20.0)
    said = by_code(fit)
    assert "displacement-drifts" not in said
    assert fit.data.window < 120.0
    assert f"fitted over the first {fit.data.window:.4g} s only" in str(said["displacement-shortened"])
    assert fit.fit.rmse <= 0.02 * fit.data.size
    found = identify(r.measurement(), base=PAPER, model="rc", engine="exact")
    row = found.observations[1]
    misfit = row.misfit
    assert misfit is not None
    told = {f.code for f in found.findings if f.values.get("quantity") == "displacement"}
    assert bool(told & {"misfit", "not-a-success"}) == (misfit.share > 0.02)
    inside = (row.abscissa >= misfit.start) & (row.abscissa < misfit.end)
    assert misfit.worst == pytest.approx(
        np.sqrt(np.mean(row.residuals[inside] ** 2)) / row.size, abs=2 * NOISE / row.size
    )


def test_readings_outside_the_window_change_nothing_but_the_record_s_own_figures() -> None:
    r, before = of_shape("comes back", 20.0)
    t = r.columns["time"] - 20.0
    other = r.columns["displacement"] + np.where(t > 100.0, 2e-4 * (t - 100.0), 0.0)
    after = fitted(r.changed(displacement=other))
    assert before.data.window == after.data.window < 100.0
    assert np.array_equal(before.fit.values, after.fit.values)
    assert before.bic_gain == after.bic_gain
    assert figures(before).measured == figures(after).measured
    assert figures(after).record is not None
    assert figures(after).record != figures(before).record


def test_without_rest_they_count_from_the_first_reading_and_say_so() -> None:
    r = made(SHAPES["comes back"], 20.0)
    after = r.rows(r.columns["time"] >= 20.0)
    found = figures(fitted(after))
    assert found.resting == 0
    assert found.rest == after.columns["displacement"][0]
    assert "(the first reading)" in "\n".join(metrics_lines(found))


def test_of_span_is_of_the_readings(step_fit: Identification) -> None:
    moved = step_fit.observations[1]
    assert moved.size == np.ptp(moved.data)
    assert f"({moved.rms_joint / moved.size:.2%} of the span)" in step_fit.summary()
    last = moved.windows()[-1]
    assert f"{last.rms / moved.size:.2%}" in step_fit.summary()


def test_a_shortened_fit_has_the_whole_record_s_figures_beside_its_own() -> None:
    r = made(SHAPES["comes back"], 2.0)
    found = identify(r.measurement(), model="rc", engine="exact")
    assert found.metrics is not None
    assert found.metrics.record is not None
    text = found.summary()
    assert "measured to 120 s" in text
    assert "readings less the rest position of 8" in text
    entry = found.to_dict()["displacement"]["figures"]
    assert entry["measured_over_record"]["final"] == float(found.metrics.record.final)
    assert entry["record_until_s"] == pytest.approx(120.0)


def test_a_drift_of_which_the_rest_says_nothing_is_left_out_and_said() -> None:
    found = identify(made(SHAPES["comes back"], 0.4).measurement(), model="rc", engine="exact")
    assert "does not determine a drift over" in found.summary()
    assert found.to_dict()["derived"]["displacement_drift"]["held"].startswith("left out")


# -- a drift as far as the rest supports it ----------------------------------------------------------------------------


def paper(rest: int, drift: float, seed: int = 4) -> Synthetic:
    return record(step(), 300.0, 301, rest=rest, displacement=True, noise=0.003, drift=drift, seed=seed)


@pytest.mark.parametrize("drift", [0.0, 1e-6, -3e-6])
def test_where_the_rest_tells_it_a_drift_is_always_fitted(drift: float) -> None:
    fit = fitted(paper(60, drift))
    assert fit.data.window == 300.0
    assert fit.drift == pytest.approx(drift, abs=4 * float(fit.fit.nuisance_errors[1]))
    assert ("displacement-drifts" in by_code(fit)) == bool(drift)


@pytest.mark.parametrize("drift", [6e-6, 1e-5])
def test_a_drift_that_is_beyond_doubt_is_fitted_however_vague(drift: float) -> None:
    """A rest that knew the slope to a part of itself left it out: the natural frequency was 13 % off, and sure."""
    fit = fitted(paper(15, drift, 1))
    rest = fit.at_rest
    assert 0.4 * rest.slope < rest.half < rest.slope
    assert rest.half * 300.0 > 0.1 * fit.data.size
    assert fit.data.window == 300.0
    assert fit.drift == pytest.approx(drift, abs=4 * float(fit.fit.nuisance_errors[1]))
    assert PAPER.coupling is not None
    assert fit.fit.values[3] == pytest.approx(PAPER.coupling.natural_frequency, abs=4 * float(fit.fit.errors[3]))


@pytest.mark.parametrize("drift", [2e-6, 6e-6])
def test_a_drift_that_a_short_rest_does_not_tell_is_fitted(drift: float) -> None:
    """A rest of 12 s before 300 s left a drift out: the natural frequency was 16 % off, and sure."""
    fit = fitted(paper(12, drift, 1))
    assert not fit.at_rest.drifts
    assert fit.data.window == 300.0
    assert fit.drift == pytest.approx(drift, abs=4 * float(fit.fit.nuisance_errors[1]))
    assert PAPER.coupling is not None
    assert fit.fit.values[3] == pytest.approx(PAPER.coupling.natural_frequency, abs=4 * float(fit.fit.errors[3]))


def test_a_drift_that_might_be_there_widens_the_intervals() -> None:
    """A fit of the same readings that leaves the drift out would be surer than it may be."""
    found = fitted(paper(60, 0.0))
    problem = Problem((replace(found.data, drift=False).observation(found.motion),), EC31.parameters)
    without = fitting.fit(problem, found.fit.values)
    assert found.data.drift
    assert (found.fit.errors > without.errors).all()
    assert found.fit.errors[3] > 1.05 * without.errors[3]


@pytest.mark.parametrize("rest", [0, 5, 8])
def test_a_short_rest_supports_none(rest: int) -> None:
    fit = fitted(paper(rest, 0.0))
    assert fit.drift is None
    assert fit.data.window == 300.0
    assert len(fit.fit.nuisance) == 1


def test_a_slope_beyond_the_rest_s_own_is_held_and_said() -> None:
    """The record rises along a line that its rest does not have."""
    r = paper(60, 0.0)
    t = r.columns["time"] - 60.0
    fit = fitted(r.changed(displacement=r.columns["displacement"] + 1e-6 * np.maximum(t, 0.0)))
    assert fit.wanted is not None
    assert fit.drift == fit.data.held == pytest.approx(fit.at_rest.nearest(1e-6), rel=1e-12)
    assert fit.drift < fit.wanted
    finding = by_code(fit)["displacement-drift-held"]
    assert finding.values["wanted"] == fit.wanted
    assert "displacement-drifts" not in by_code(fit)


# -- the rest by itself ------------------------------------------------------------------------------------------------


def channel(values: Array, step: float = 0.5) -> Channel:
    t = step * np.arange(-len(values), 3)
    return Channel(t, np.concatenate([values, np.full(3, values[-1])]))


@given(
    slope=st.floats(-1e-5, 1e-5),
    position=st.floats(-0.1, 0.1),
    count=st.integers(10, 60),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=40)
def test_the_line_through_the_rest(slope: float, position: float, count: int, seed: int) -> None:
    t = 0.5 * np.arange(-count, 0)
    noise = 1e-6 * np.random.default_rng(seed).standard_normal(count)
    rest = channel(position + slope * t + noise).at_rest
    expected = np.polynomial.Polynomial.fit(t, position + slope * t + noise, 1).convert().coef
    assert rest.position(rest.slope) == pytest.approx(expected[0], abs=1e-12)
    assert rest.slope == pytest.approx(expected[1], abs=1e-12)
    assert rest.length == pytest.approx(0.5 * count)
    assert rest.half > 0
    inside = rest.slope + 0.5 * rest.half
    assert rest.nearest(inside) == inside
    assert rest.nearest(rest.slope + 2 * rest.half) == rest.slope + rest.half


def test_the_interval_of_its_slope_holds_the_truth() -> None:
    missed = 0
    for seed in range(300):
        values = 1e-6 * np.random.default_rng(seed).standard_normal(24)
        rest = channel(values).at_rest
        missed += abs(rest.slope) > rest.half
    assert missed <= 5


def test_readings_that_do_not_change_tell_a_slope_within_a_step_of_the_instrument() -> None:
    values = np.full(20, 3e-3)
    c = channel(values)
    rest = replace(c, values=np.append(c.values[:-1], 3e-3 + 5e-6)).at_rest
    assert rest.slope == 0
    assert rest.half == pytest.approx(5e-6 / (0.5 * 19))


@pytest.mark.parametrize(("count", "told"), [(10, True), (9, False), (0, False)])
def test_ten_readings_bound_a_drift(count: int, told: bool) -> None:
    values = 1e-6 * np.random.default_rng(3).standard_normal(count + 1)[:count]
    rest = Channel(0.5 * np.arange(-count, 3), np.append(values, np.zeros(3))).at_rest
    assert rest.bounds_drift is told
    assert np.isfinite(rest.half) == told


# -- the closed form ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_the_closed_form_is_the_engine_s(beam: str) -> None:
    fit = fitted(paper(20, 0.0))
    motion = replace(fit.motion, beam=beam)
    data: DisplacementData = replace(fit.data, sign=-1.0)
    values = np.outer([1.0, 1.1], fit.fit.values)
    found = data.observation(motion).predict(values)
    slow = -motion.displacements(data.drive, data.abscissa, values, DEFAULT_ACCURACY)
    assert found == pytest.approx(slow, abs=1e-9 * float(np.abs(slow).max()))


def test_ngspice_confirms_the_closed_form() -> None:
    found = identify(paper(20, 0.0).measurement(), base=PAPER, model="rc", engine="ngspice")
    judgement = found.statistics["judgement"]
    assert not judgement["refitted"]
    assert judgement["largest_move_in_standard_errors"] < 0.02
