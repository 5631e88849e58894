"""The electromechanical fit: d(s) recovered, the same answer as a fit of the closed form, axis, rest and drift."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
from synthetic import Synthetic, current_data, drives, record, scaled, step

from ilg_circuit.errors import IlgError, InputError
from ilg_circuit.findings import codes
from ilg_circuit.identification import Identification, identify
from ilg_circuit.identification.displacement import DisplacementFit, fit_displacement
from ilg_circuit.identification.motion_laws import EC31
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import PAPER, Actuator, Coupling
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]

#: gel of composite stiffness: the beam follows at once, so that only d(s) is seen
STIFF = replace(PAPER, material=replace(PAPER.material, youngs_modulus=100e6))
NAMES = tuple(p.name for p in EC31.parameters)
NOISE = 0.003


def truth(strip: Actuator) -> Array:
    k = strip.coupling
    assert k is not None
    return np.array([k.gain, k.zero, k.damping_ratio, k.natural_frequency])


def fitted(r: Synthetic, strip: Actuator | None = None, engine: str = "ngspice") -> DisplacementFit:
    """With the circuit known, so that nothing but the displacement is fitted."""
    return fit_displacement(current_data(r, engine), strip or r.strip)


def individual(result: Identification) -> DisplacementFit:
    assert result.coupling is not None
    return result.coupling.individual[0]


def assert_recovered(found: DisplacementFit, strip: Actuator, sigmas: float = 4.5) -> None:
    away = np.abs(found.fit.values - truth(strip))
    assert (away <= sigmas * found.fit.errors + 1e-5 * truth(strip)).all(), away / found.fit.errors


def static(found: DisplacementFit) -> float:
    return found.coupling.static


# -- truth recovered ---------------------------------------------------------------------------------------------------


def test_a_step_with_the_static_beam(step_record: Synthetic, step_fit: Identification) -> None:
    found = individual(step_fit)
    assert_recovered(found, PAPER)
    assert found.fit.labels == NAMES
    assert found.motion.beam == "static"
    assert found.data.sign == 1.0
    assert abs(found.fit.nuisance[1]) < 3 * found.fit.nuisance_errors[1]  # the drift, of which there is none
    assert found.data.window == 300.0
    assert found.findings == ()
    assert found.rest == pytest.approx(5e-3, abs=5e-6)
    assert found.per_volt == pytest.approx(3.9805e-3 / 4, rel=0.005)
    assert len(found.fit.residuals) == 321
    assert found.fit.rmse == pytest.approx(NOISE * 4.339e-3, rel=0.1)
    assert found.fitted == pytest.approx(step_record.columns["displacement"], abs=6 * NOISE * 4.339e-3)


@pytest.mark.parametrize("voltage", [4.0, -4.0])
def test_the_dynamic_beam_is_told_from_the_static_one(voltage: float) -> None:
    found = fitted(record(step(voltage), 300.0, 301, beam="dynamic", rest=20, displacement=True, noise=1e-3, seed=2))
    assert found.motion.beam == "dynamic"
    assert_recovered(found, PAPER)
    assert "displacement-shows-inertia" in codes(found.findings)


@pytest.mark.parametrize("drift", [3e-6, -3e-6])
@pytest.mark.parametrize("voltage", [4.0, -4.0])
def test_a_drift_as_large_as_a_quarter_of_the_answer_is_told(drift: float, voltage: float) -> None:
    r = record(step(voltage), 300.0, 301, rest=30, displacement=True, noise=NOISE, drift=drift, rest_position=7e-3)
    found = fitted(r, engine="exact")
    assert found.drift == pytest.approx(drift, rel=0.03)
    assert_recovered(found, PAPER)
    assert "displacement-drifts" in codes(found.findings)


def test_a_stiff_beam_needs_no_inertia() -> None:
    found = fitted(record(step(), 300.0, 301, strip=STIFF, beam="dynamic", rest=20, displacement=True, noise=1e-3))
    assert found.motion.beam == "static"
    assert_recovered(found, STIFF)


@pytest.mark.parametrize(("kind", "voltage"), [("step", -4.0), ("square", 4.0), ("sine", -2.0), ("ramp", 4.0)])
def test_every_drive_and_both_polarities(kind: str, voltage: float) -> None:
    r = record(drives(voltage)[kind], 300.0, 201, rest=20, displacement=True, noise=NOISE, seed=3)
    found = fitted(r, engine="ngspice" if kind == "step" else "exact")
    assert_recovered(found, PAPER)
    assert found.data.sign == 1.0


@pytest.mark.parametrize("voltage", [4.0, -4.0])
def test_a_reversed_camera_axis_is_found_and_said(voltage: float) -> None:
    r = record(step(voltage), 300.0, 201, rest=20, displacement=True, noise=NOISE, axis=-1.0, rest_position=2e-3)
    found = fitted(r)
    assert found.data.sign == -1.0
    assert_recovered(found, PAPER)
    assert found.per_volt < 0
    assert found.level == pytest.approx(2e-3, abs=1e-5)
    assert found.rest == pytest.approx(2e-3, abs=8 * NOISE * 4.339e-3 / np.sqrt(20))  # by the line through 20 readings
    assert "displacement-axis-reversed" in codes(found.findings)


def test_without_noise_the_truth_is_exact() -> None:
    found = fitted(record(step(), 300.0, 201, rest=10, displacement=True, rest_position=5e-3))
    assert found.fit.values == pytest.approx(truth(PAPER), rel=1e-5)
    assert found.rest == pytest.approx(5e-3, rel=1e-9)


def test_a_slow_drift_is_set_aside() -> None:
    drift = 2e-6
    r = record(step(), 300.0, 301, rest=30, displacement=True, noise=NOISE, drift=drift, rest_position=5e-3, seed=5)
    found = fitted(r)
    assert found.data.window == 300.0
    assert found.drift == pytest.approx(drift, abs=4 * float(found.fit.nuisance_errors[1]))
    assert_recovered(found, PAPER)


def test_a_late_drift_that_no_line_follows_shortens_the_window() -> None:
    r = record(step(), 300.0, 301, rest=20, displacement=True, noise=1e-3, seed=6)
    t = r.columns["time"] - 20.0
    strayed = r.columns["displacement"] + 3e-3 * np.maximum(t / 300 - 0.4, 0) ** 2
    found = fitted(r.changed(displacement=strayed))
    assert found.data.window < 250.0
    (finding,) = (f for f in found.findings if f.code == "displacement-shortened")
    assert "fitted over the first" in str(finding)
    assert static(found) == pytest.approx(PAPER.coupling.static if PAPER.coupling else 0.0, rel=0.1)


@pytest.mark.parametrize("damping", [0.2, 1.0, 2.3])
def test_under_critically_and_over_damped(damping: float) -> None:
    k = PAPER.coupling
    assert k is not None
    strip = replace(PAPER, coupling=Coupling(k.gain, 0.02, damping, k.natural_frequency))
    found = fitted(record(step(), 300.0, 301, strip=strip, rest=20, displacement=True, noise=1e-3, seed=7))
    assert_recovered(found, strip)


@pytest.mark.parametrize("time", [1e-3, 100.0])
def test_fast_and_slow_strips(time: float) -> None:
    strip = scaled(time, 0.01)
    r = record(step(), 300.0 * time, 201, strip=strip, rest=20, displacement=True, noise=NOISE, seed=8)
    found = fitted(r)
    assert found.motion.beam == "static"
    assert_recovered(found, strip)


def test_blanks_are_gaps() -> None:
    r = record(step(), 300.0, 401, rest=20, displacement=True, noise=NOISE, seed=9)
    gaps = r.columns["displacement"].copy()
    gaps[::3] = np.nan
    gaps[200:230] = np.nan
    found = fitted(r.changed(displacement=gaps))
    assert_recovered(found, PAPER)
    assert len(found.fit.residuals) == np.isfinite(gaps).sum()


# -- against the closed form -------------------------------------------------------------------------------------------


def peer(r: Synthetic, found: DisplacementFit, columns: int) -> tuple[Array, Array]:
    """Values and standard errors by scipy's least squares on EC (34) with the same rest position and drift."""
    t, data = found.data.channel.time, found.data.channel.values
    ratio = lumped_elements(r.strip).bending_ratio
    scale = np.concatenate([truth(r.strip), [1e-3, 1e-6][:columns]])

    def residual(p: Array) -> Array:
        q = p * scale
        moved = np.where(t >= 0, 4 * formulas.displacement_step(t, *q[:4], ratio), 0.0)
        return 1e3 * (moved + sum(q[4 + k] * t**k for k in range(columns)) - data)

    result = least_squares(residual, np.ones(4 + columns), method="lm", jac="3-point", xtol=1e-14, ftol=1e-14)
    covariance = np.linalg.inv(result.jac.T @ result.jac) * 2 * result.cost / (len(t) - 4 - columns)
    return (result.x * scale)[:4], (np.sqrt(np.diag(covariance)) * scale)[:4]


@pytest.mark.parametrize("drift", [0.0, 2e-6])
def test_the_closed_form_s_least_squares(step_record: Synthetic, step_fit: Identification, drift: float) -> None:
    if drift:
        r = record(step(), 300.0, 301, rest=30, displacement=True, noise=NOISE, drift=drift, seed=12)
        found = fitted(r)
    else:
        r, found = step_record, individual(step_fit)
    values, errors = peer(r, found, len(found.fit.nuisance))
    assert (np.abs(found.fit.values - values) <= 0.1 * errors).all()
    assert found.fit.errors == pytest.approx(errors, rel=0.02)


def test_both_engines_find_the_same(step_record: Synthetic, step_fit: Identification) -> None:
    exact, found = fitted(step_record, engine="exact"), individual(step_fit)
    assert (np.abs(found.fit.values - exact.fit.values) <= 0.02 * exact.fit.errors).all()
    assert found.fit.errors == pytest.approx(exact.fit.errors, rel=1e-3)
    assert (found.motion.beam, found.data.window, found.drift) == (exact.motion.beam, exact.data.window, exact.drift)


def test_gains_scale_with_the_geometry_and_nothing_else_does(step_record: Synthetic, step_fit: Identification) -> None:
    base = individual(step_fit)
    g = PAPER.geometry
    for geometry in (replace(g, load_position=15e-3), replace(g, thickness=0.25e-3)):
        strip = replace(PAPER, geometry=geometry)
        found = fitted(step_record, strip)
        factor = (geometry.thickness / geometry.load_distance) ** 2 / (g.thickness / g.load_distance) ** 2
        assert found.fit.values[0] == pytest.approx(base.fit.values[0] * factor, rel=1e-4)
        assert found.fit.values[1:] == pytest.approx(base.fit.values[1:], rel=1e-4)
        assert found.per_volt == pytest.approx(base.per_volt, rel=1e-4)


# -- no answer ---------------------------------------------------------------------------------------------------------


def test_pure_noise_determines_nothing() -> None:
    """Either no fit can be made, or its parameters are said to mean nothing; never a sure answer."""
    r = record(step(), 300.0, 201, rest=20, displacement=True)
    for seed in (13, 14):
        noise = np.random.default_rng(seed).standard_normal(221) * 1e-3
        with suppress(IlgError):
            found = fitted(r.changed(displacement=noise), engine="exact")
            assert "not-determined" in codes(found.findings)


def test_a_tip_that_never_moves_has_no_coupling() -> None:
    r = record(step(), 300.0, 201, rest=20, displacement=True)
    with pytest.raises(InputError, match="does not follow the voltage"):
        fitted(r.changed(displacement=np.full(221, 7e-3)))


def test_an_onset_between_readings_is_no_inertia() -> None:
    """A strip whose beam is static, its onset at the end of what its readings leave open."""
    r = record(step(), 300.0, 151, rest=20, displacement=True, noise=3e-3, rest_position=5e-3, seed=11)
    found = identify(prepare(r.table()), base=PAPER, model="rc", engine="exact")
    assert found.coupling is not None
    assert found.coupling.motion.beam == "static"
    truth = lumped_elements(PAPER).port
    for name in ("dynamic_resistance", "capacitance"):
        low, high = found.parameters[name].reported[1]
        assert low <= getattr(truth, name) <= high
    onset = found.derived["onset"].ci95
    assert onset is not None
    assert onset[0] <= 40.0 <= onset[1] + 1e-9
