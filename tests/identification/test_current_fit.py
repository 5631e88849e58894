"""The fit of a current: truth recovered, the same answer as a fit of the closed form, standard errors included."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
from synthetic import Synthetic, drives, fit_current, record, scaled, step, two_branches

from ilg_circuit.errors import IlgError, InputError
from ilg_circuit.findings import codes
from ilg_circuit.identification import Identification, identify
from ilg_circuit.identification.port_fit import PortFit
from ilg_circuit.measurements.record import Record
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]


def truth(strip: Actuator) -> Array:
    lumped = lumped_elements(strip)
    ordered = sorted(lumped.port.branches, key=lambda pair: pair[0] * pair[1])
    return np.array([lumped.port.dc_resistance, *(x for pair in ordered for x in pair)])


def identified(r: Synthetic, model: str = "auto", engine: str = "ngspice") -> Identification:
    """From the current alone, of a strip without a coupling, of which there would be something to be said."""
    base = replace(r.strip, coupling=None)
    return identify(r.changed(displacement=None).measurement(), base=base, model=model, engine=engine)


def assert_recovered(found: PortFit, strip: Actuator, sigmas: float = 4.0) -> None:
    away = np.abs(found.fit.values - truth(strip))
    assert (away <= sigmas * found.fit.errors + 1e-6 * truth(strip)).all(), away / found.fit.errors


def peer(m: Record, start: Array, resistance: float = 0.0, offset: bool = False) -> tuple[Array, Array]:
    """Values and standard errors by scipy's least squares on the closed form of a step, all samples alike."""
    after = np.ones(len(m.current.time), dtype=bool) if offset else ~m.current.rest
    t, data = m.current.time[after], m.current.values[after]
    assert m.step is not None

    def residual(p: Array) -> Array:
        values = p * start if not offset else np.append(p[:-1] * start[:-1], p[-1] * start[-1])
        pairs = values[1 : len(values) - offset].reshape(-1, 2)
        total = np.full(len(t), values[-1] if offset else 0.0)
        for k, (r, c) in enumerate(pairs):
            a0, a1, rate = formulas.current_constants(values[0], r, c, resistance)
            total += m.step * formulas.current_step(t, 0.0 if k else a0, a1, rate)
        return total - data

    result = least_squares(
        residual, np.ones(len(start)), method="lm", jac="3-point", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    freedom = len(t) - len(start)
    covariance = np.linalg.inv(result.jac.T @ result.jac) * 2 * result.cost / freedom
    return result.x * start, np.sqrt(np.diag(covariance)) * np.abs(start)


# -- truth recovered ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("voltage", [4.0, -4.0])
@pytest.mark.parametrize("kind", ["step", "square", "sine", "ramp"])
def test_rc_is_recovered_under_every_drive(kind: str, voltage: float) -> None:
    r = record(drives(voltage)[kind], 300.0, 301, rest=20, noise=0.003, seed=21)
    found = identified(r, "rc")
    assert_recovered(found.port, PAPER)
    assert found.findings == ()
    assert found.fit.rmse == pytest.approx(0.003 * np.abs(r.columns["current"]).max(), rel=0.15)


def test_rc_is_recovered_from_the_dynamic_beam() -> None:
    """The beam reflects a voltage onto the current, negligible for this strip: EC (20), (21)."""
    assert_recovered(fit_current(record(step(), 300.0, 301, beam="dynamic", noise=0.002, seed=22)), PAPER)


def test_without_noise_the_truth_is_exact() -> None:
    found = fit_current(record(step(), 300.0, 301))
    assert found.fit.values == pytest.approx(truth(PAPER), rel=1e-6)
    (data,) = found.data
    assert found.fit.fitted(0) == pytest.approx(data.data, rel=1e-6)


@pytest.mark.parametrize("time_constant", [10e-3, 0.3, 6.8, 1000.0])
@pytest.mark.parametrize("size", [0.005, 10.0], ids=["milliamperes", "amperes"])
def test_any_time_constant_and_any_current(time_constant: float, size: float) -> None:
    tau = float(np.prod(truth(PAPER)[1:]))
    strip = scaled(time_constant / tau, size)
    r = record(step(), 300.0 * time_constant / tau, 201, strip=strip, noise=0.003, rest=10, seed=23)
    found = fit_current(r)
    assert_recovered(found, strip)
    assert np.prod(found.port.branches[0]) == pytest.approx(time_constant, rel=0.02)


@pytest.mark.parametrize("start", [0.0, -100.0, 1e6])
def test_the_clock_does_not_matter(start: float) -> None:
    found = fit_current(record(step(), 300.0, 201, rest=10, noise=0.003, seed=24, start=start))
    expected = fit_current(record(step(), 300.0, 201, rest=10, noise=0.003, seed=24))
    assert found.fit.values == pytest.approx(expected.fit.values, rel=1e-6)


def test_an_offset_of_the_instrument_is_fitted_with_the_rest() -> None:
    """Always where five samples or more are at rest: there need be none to be seen."""
    for offset in (1e-3, 0.0):
        found = fit_current(record(step(), 300.0, 301, rest=40, noise=0.002, current_offset=offset, seed=25))
        assert found.fit.nuisance == pytest.approx([offset], abs=4 * float(found.fit.nuisance_errors[0]))
        assert_recovered(found, PAPER)
        assert len(found.fit.residuals) == 341
    few = fit_current(record(step(), 300.0, 301, rest=4, noise=0.002, seed=25))
    assert (len(few.fit.nuisance), len(few.fit.residuals)) == (0, 301)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rc2_is_recovered_with_its_branches_sorted(seed: int) -> None:
    strip = two_branches()
    found = fit_current(record(step(), 300.0, 601, strip=strip, noise=5e-4, seed=seed), "rc2")
    assert_recovered(found, strip)
    constants = [r * c for r, c in found.port.branches]
    assert all(a < b for a, b in pairwise(constants))
    assert found.fit.labels == ("dc_resistance", "resistance_1", "capacitance_1", "resistance_2", "capacitance_2")
    assert found.identifiability().determined


def test_rc2_under_a_square_wave_with_electrodes() -> None:
    strip = two_branches()
    electrodes = replace(strip.material, electrode_resistivity_1=175.0, electrode_thickness_1=2e-6)
    strip = replace(strip, material=electrodes)  # 2 ohm
    r = record(drives(4.0)["square"], 300.0, 601, strip=strip, noise=5e-4, seed=4)
    assert_recovered(fit_current(r, "rc2", 2.0), strip)


# -- against the closed form -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [1e-3, 0.02])
@pytest.mark.parametrize("resistance", [0.0, 5.0])
def test_rc_is_the_closed_form_s_least_squares(noise: float, resistance: float) -> None:
    m = record(step(), 300.0, 301, rest=3, noise=noise, seed=31).measurement()
    found = fit_current(m, "rc", resistance)
    values, errors = peer(m, truth(PAPER), resistance)
    assert (np.abs(found.fit.values - values) <= 0.1 * errors).all()
    assert found.fit.errors == pytest.approx(errors, rel=0.02)


def test_rc_with_an_offset_is_the_closed_form_s_least_squares() -> None:
    m = record(step(), 300.0, 301, rest=40, noise=0.005, current_offset=2e-3, seed=32).measurement()
    found = fit_current(m, "rc")
    after = np.append(truth(PAPER), 2e-3)
    t = m.current.time

    def residual(p: Array) -> Array:
        a0, a1, rate = formulas.current_constants(*(p[:3] * after[:3]))
        return 4 * formulas.current_step(t, a0, a1, rate) + p[3] * after[3] - m.current.values

    result = least_squares(residual, np.ones(4), method="lm", jac="3-point")
    errors = np.sqrt(np.diag(np.linalg.inv(result.jac.T @ result.jac)) * 2 * result.cost / (len(t) - 4)) * after
    got = np.append(found.fit.values, found.fit.nuisance)
    assert (np.abs(got - result.x * after) <= 0.1 * errors).all()
    assert np.append(found.fit.errors, found.fit.nuisance_errors) == pytest.approx(errors, rel=0.02)


def test_rc2_is_the_closed_form_s_least_squares() -> None:
    strip = two_branches()
    m = record(step(), 300.0, 601, strip=strip, noise=1e-3, seed=33).measurement()
    found = fit_current(m, "rc2")
    values, errors = peer(m, truth(strip))
    assert (np.abs(found.fit.values - values) <= 0.1 * errors).all()
    assert found.fit.errors == pytest.approx(errors, rel=0.02)


def test_statistics_are_those_of_the_residuals() -> None:
    found = fit_current(record(step(), 300.0, 301, noise=0.01, seed=34)).fit
    n, chi = len(found.residuals), float((found.residuals**2).sum())
    assert found.rmse == pytest.approx(np.sqrt(chi / n))
    assert found.aic == pytest.approx(n * np.log(chi / n) + 2 * 3)
    assert found.bic == pytest.approx(n * np.log(chi / n) + np.log(n) * 3)


@pytest.mark.parametrize("kind", ["rc", "rc2"])
def test_both_engines_find_the_same(kind: str) -> None:
    strip = two_branches()
    m = record(step(), 300.0, 301, strip=strip, noise=2e-3, seed=35).measurement()
    by_ngspice, exact = (fit_current(m, kind, engine=engine) for engine in ("ngspice", "exact"))
    assert (np.abs(by_ngspice.fit.values - exact.fit.values) <= 0.01 * exact.fit.errors).all()
    assert by_ngspice.fit.errors == pytest.approx(exact.fit.errors, rel=1e-3)


# -- four elements, three observables ----------------------------------------------------------------------------------


@pytest.mark.parametrize("resistance", [0.0, 0.5, 5.0, 12.0, 18.0])
def test_holding_re_is_the_closed_form_s_inverse(step_record: Synthetic, resistance: float) -> None:
    m = step_record.measurement()
    free = fit_current(m, "rc")
    a0, a1, rate = formulas.current_constants(*free.fit.values)
    expected = formulas.resistances_from_step(4 * a0, 4 * a1, rate, 4.0, resistance)
    held = fit_current(m, "rc", resistance)
    assert (np.abs(held.fit.values - expected) <= 0.01 * held.fit.errors).all()
    assert held.fit.rmse == pytest.approx(free.fit.rmse, rel=1e-9)


@pytest.mark.parametrize("resistance", [19.5, 1000.0, -1.0, np.nan, np.inf])
def test_an_electrode_resistance_that_cannot_be(step_record: Synthetic, resistance: float) -> None:
    with pytest.raises(InputError, match="electrode resistance"):
        identify(step_record.changed(displacement=None).measurement(), electrode_resistance=resistance)


# -- which model -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("kind", ["step", "sine"])
def test_auto_keeps_one_branch_for_one_branch(kind: str, noise: float) -> None:
    found = identified(record(drives(4.0)[kind], 300.0, 101, noise=noise, seed=41), engine="exact")
    assert found.model == "rc"
    # beginning at its first reading, a step has no onset to be read and nothing has a rest
    expected = {"onset-assumed", "offset-assumed"} if kind == "step" else {"offset-assumed"}
    assert codes(found.findings) == expected


@pytest.mark.parametrize("noise", [1e-4, 2e-3])
@pytest.mark.parametrize("kind", ["step", "square"])
def test_auto_takes_two_branches_for_two(kind: str, noise: float) -> None:
    found = identified(
        record(drives(4.0)[kind], 300.0, 301, strip=two_branches(), noise=noise, seed=42), engine="exact"
    )
    assert found.model == "rc2"
    assert [c.model for c in found.candidates][:4] == ["rc", "rc2", "rc3", "warburg"]
    assert_recovered(found.port, two_branches())


def test_auto_is_rarely_misled_by_noise() -> None:
    chosen = [identified(record(step(), 300.0, 151, noise=0.01, seed=s)).model for s in range(6)]
    assert chosen == ["rc"] * 6


def test_one_branch_for_two_is_warned_of() -> None:
    found = identified(record(step(), 300.0, 601, strip=two_branches(), noise=1e-3, seed=43), "rc")
    assert {"one-pole-not-enough", "residuals-autocorrelated"} <= codes(found.findings)
    assert any("one pole is not enough" in w and "model='rc2'" in w for w in found.warnings)
    assert any("standard errors allow for it, by an autoregression" in w for w in found.warnings)


def test_what_the_data_do_not_determine_is_named() -> None:
    """A record that ends long before the steady current leaves Rdc without an upper limit, and two branches alike."""
    found = identified(record(step(), 6.0, 101, noise=0.003, seed=44), "rc")
    (finding,) = (f for f in found.findings if f.code == "electron-path-vague")
    assert finding.values["share"] > 0.5
    assert found["dc_resistance"].reported[1][1] == np.inf
    found = identified(record(step(), 30.0, 101, noise=0.003, seed=44), "rc2")
    assert "capacitance_1 has no lower limit" in found.port.identifiability().open
    (finding,) = (f for f in found.findings if f.code == "not-determined")
    assert "capacitance_1" in finding.values["reason"]
    assert "profile open" in str(finding)


@pytest.mark.parametrize("model", ["rc9", "", "RC"])
def test_an_unknown_model(step_record: Synthetic, model: str) -> None:
    with pytest.raises(InputError, match="model is"):
        identify(step_record.measurement(), model=model)


def test_a_current_that_runs_the_other_way_is_refused() -> None:
    r = record(step(), 300.0, 201, noise=1e-3, seed=45)
    with pytest.raises(IlgError):
        fit_current(r.changed(current=-r.columns["current"]))
