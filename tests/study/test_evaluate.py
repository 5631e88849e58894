"""Outputs of many scenarios against closed forms, other engines and `simulate`; failures that stop nothing."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from ilg_circuit.circuit.load import Load
from ilg_circuit.errors import InputError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Coupling
from ilg_circuit.study import OUTPUTS, ScenarioTemplate, evaluate, evaluate_designs

STATIC = ScenarioTemplate(PAPER, "step:4V", 300.0, beam="static")
FULL = ScenarioTemplate(PAPER, "step:4V", 300.0)


def _closed(t: float, strip: Coupling, ratio: float = 3 * 60.0**2) -> float:
    k = strip
    return float(4 * formulas.displacement_step(t, k.gain, k.zero, k.damping_ratio, k.natural_frequency, ratio))


@pytest.mark.parametrize("engine", ["exact", "ngspice"])
@pytest.mark.parametrize("damping", [0.1, 0.6212, 1.4])
def test_a_step_by_its_closed_form(engine: str, damping: float) -> None:
    """Peak, its time, 90 %, settling, mean square: all lie between samples."""
    k = replace(PAPER.coupling, damping_ratio=damping)
    found = evaluate_designs(STATIC, {"damping_ratio": [damping]}, engine=engine, accuracy=1e-7)
    value = {o.name: x for o, x in zip(found.outputs, found.values[0], strict=True)}
    end = _closed(300.0, k)
    peak = minimize_scalar(lambda t: -_closed(t, k), bounds=(5.0, 100.0), method="bounded", options={"xatol": 1e-9})
    t = np.linspace(0, 300, 400_001)
    y = 4 * formulas.displacement_step(t, k.gain, k.zero, k.damping_ratio, k.natural_frequency, 3 * 60.0**2)
    last = int(np.flatnonzero(np.abs(y - end) > 0.02 * end)[-1])
    settled = brentq(lambda s: abs(_closed(s, k) - end) - 0.02 * end, t[last], t[last + 1])
    assert value["displacement_final"] == pytest.approx(end, rel=1e-6)
    if damping < 1:
        assert value["displacement_peak"] == pytest.approx(-peak.fun, rel=1e-6)
        assert value["time_of_peak"] == pytest.approx(peak.x, rel=1e-4)
        assert value["overshoot"] == pytest.approx(-peak.fun / end - 1, abs=2e-6)
    first = int(np.argmax(y >= 0.9 * end))
    reached = brentq(lambda s: _closed(s, k) - 0.9 * end, t[first - 1], t[first])
    assert value["time_of_90"] == pytest.approx(reached, rel=1e-5)
    assert value["settling_time"] == pytest.approx(settled, rel=1e-5)
    assert value["displacement_rms"] == pytest.approx(np.sqrt(np.trapezoid(y**2, t) / 300), rel=1e-6)
    assert value["current_peak"] == pytest.approx(4 / 666.6667 + 4 / 19.43634, rel=1e-6)


@pytest.mark.parametrize("drive", ["step:4V", "square:-4V..2V,40s,0.3", "sine:2V,0.05Hz", "ramp:0.1V/s"])
@pytest.mark.parametrize("strip", ["paper", "rc2 electrodes", "load inside", "no coupling"])
def test_waveforms_are_those_of_simulate(drive: str, strip: str, strips: dict[str, object]) -> None:
    times = np.linspace(0, 100, 401)
    template = ScenarioTemplate(strips[strip], drive, 100.0)  # type: ignore[arg-type]
    found = evaluate_designs(
        template, {"voltage" if "ramp" not in drive else "rate": [2.0, 3.0]}, engine="exact", times=times,
        waveforms=("current", "displacement", "charge"), outputs=["energy", "charge_final"],
    )  # fmt: skip
    assert not found.failures
    text = {"s": "step:3V", "q": "square:-3V..1.5V,40s,0.3", "i": "sine:3V,0.05Hz", "r": "ramp:3V/s"}
    wanted = text["q" if drive.startswith("sq") else "i" if drive.startswith("si") else drive[0]]
    run = simulate(template.actuator, parse_drive(wanted, 100.0), times, engine="exact")
    for name, waves in found.waveforms.items():
        expected = getattr(run, name)
        assert np.isnan(waves[1]).all() == np.isnan(expected).all()
        if not np.isnan(expected).any():
            assert np.abs(waves[1] - expected).max() <= 3e-7 * np.abs(expected).max()
    assert found.output("energy")[1] == pytest.approx(run.energy[-1], rel=1e-6)
    assert found.output("charge_final")[1] == pytest.approx(run.charge[-1], rel=1e-7)


def test_engines_agree_on_full_strips() -> None:
    random = np.random.default_rng(5)
    designs = {
        "thickness": random.uniform(0.2e-3, 1e-3, 24),
        "free_length": random.uniform(15e-3, 40e-3, 24),
        "youngs_modulus": random.uniform(5e3, 50e3, 24),
        "voltage": random.uniform(-4, 4, 24),
    }
    by = {e: evaluate_designs(FULL, designs, tuple(OUTPUTS), engine=e, accuracy=1e-6) for e in ("exact", "ngspice")}
    assert by["ngspice"].errors.max() < 1e-6
    assert np.allclose(by["ngspice"].values, by["exact"].values, rtol=1e-5, atol=0, equal_nan=True)
    assert (by["exact"].output("force_final") == 0).all()
    assert (np.abs(by["exact"].output("force_blocked")) > 0).all()


def test_blocked_force_is_the_clamped_strip_s_without_its_load() -> None:
    designs = {"thickness": [0.3e-3, 0.6e-3]}
    free = evaluate_designs(replace(FULL, load=Load(mass=1e-6)), designs, ["force_blocked", "energy"], engine="exact")
    clamped = evaluate_designs(replace(FULL, tip="clamped"), designs, ["force_final", "settling_time"], engine="exact")
    assert free.output("force_blocked") == pytest.approx(clamped.output("force_final"), rel=1e-12)
    assert np.isfinite(clamped.output("settling_time")).all()


def test_failures_are_rows_with_reasons() -> None:
    designs = {"thickness": [0.5e-3, np.nan, 0.5e-3, 1e-300, 0.5e-3], "length": [35e-3, 35e-3, 20e-3, 35e-3, 36e-3]}
    found = evaluate_designs(STATIC, designs, ["displacement_final"], engine="ngspice", waveforms=["current"])
    assert sorted(found.failures) == [1, 2, 3]
    assert "thickness is nan" in found.failures[1]
    assert "longer than geometry.length" in found.failures[2]
    assert np.isfinite(found.values[[0, 4]]).all()
    assert np.isnan(found.values[[1, 2, 3]]).all()
    assert np.isnan(found.waveforms["current"][[1, 2, 3]]).all()


def test_a_nonlinear_strip_goes_to_ngspice_and_not_to_the_exact_engine() -> None:
    growing = replace(STATIC, actuator=replace(PAPER, material=replace(PAPER.material, capacitance_slope=0.1)))
    found = evaluate_designs(growing, {"voltage": [1.0, 2.0]}, ["charge_final"], engine="auto", accuracy=1e-6)
    c = 0.35
    assert found.output("charge_final") == pytest.approx([c * (1 + 0.05), c * (2 + 0.1 * 2)], rel=1e-6)
    refused = evaluate_designs(growing, {"voltage": [1.0, 2.0]}, engine="exact")
    assert len(refused.failures) == 2
    assert "linear circuits only" in refused.failures[0]


@pytest.mark.parametrize("drive", ["square:-2V..2V,30s", "sine:2V,0.05Hz"])
def test_waveforms_with_kinks_are_those_of_simulate(drive: str) -> None:
    """A charge that passes zero bends the current where no pole tells: panels are cut until they see it."""
    material = replace(PAPER.material, emission_voltage=1.0, capacitance_slope=0.3)
    template = replace(STATIC, actuator=replace(PAPER, material=material), drive=drive, duration=40.0)
    times = np.linspace(0, 40, 401)
    kept = ("current", "charge", "displacement")
    found = evaluate_designs(template, {"width": [5e-3, 6e-3]}, ["energy"], waveforms=kept, times=times)
    assert found.errors.max() < 2e-6
    run = simulate(template.actuator, parse_drive(drive, 40.0), times, beam="static", accuracy=1e-6)
    for name in kept:
        expected = getattr(run, name)
        assert np.abs(found.waveforms[name][0] - expected).max() <= 2e-6 * np.abs(expected).max()
    assert found.output("energy")[0] == pytest.approx(run.energy[-1], rel=1e-6)


def test_wrong_words() -> None:
    for how, hint in (
        ({"engine": "spice"}, "choose one of ngspice"),
        ({"outputs": ["displacement"]}, "choose from displacement_final"),
        ({"waveforms": ["voltage"]}, "choose from current"),
        ({"outputs": []}, "no output"),
    ):
        with pytest.raises(InputError, match=hint):
            evaluate([], **how)  # type: ignore[arg-type]
