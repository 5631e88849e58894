"""A band that holds the misfit: kept with the fit, it covers held-out records that the model does not describe."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.arrays import Array
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.strip.actuator import PAPER, Actuator, Uncertainty
from ilg_circuit.strip.file import dumps, loads
from ilg_circuit.strip.port import Port
from ilg_circuit.strip.uncertainty import Residuals

#: What no rc describes: three branches, and a drift that grows with time.
PORT = Port(600.0, ((25.0, 0.15), (60.0, 0.2), (300.0, 0.1)))
STRIP = replace(Actuator.from_port(PAPER.geometry, PORT, base=PAPER.material), coupling=PAPER.coupling)


def record(drive: str, seed: int, strip: Actuator = STRIP, duration: float = 100.0) -> dict[str, Array]:
    random, t = np.random.default_rng(seed), np.arange(-10.0, duration, 0.5)
    on = t >= 0
    run = ilg.simulate(strip, drive, times=t[on], engine="exact", beam="static")
    u, i, y = (np.r_[np.zeros((~on).sum()), row] for row in (run.voltage, run.current, run.displacement))
    peak = np.abs(i).max()
    noisy = i + peak * (2e-3 * np.maximum(t, 0) / duration + 1e-3 * random.normal(size=len(t)))
    return {"time_s": t, "voltage_V": u, "current_A": noisy, "displacement_m": y + 3e-5 * random.normal(size=len(t))}


@pytest.fixture(scope="module")
def fit() -> Any:
    return ilg.identify(record("step:2V", 0), "paper", model="rc", engine="exact")


def without(strip: Actuator) -> Actuator:
    assert strip.uncertainty is not None
    return replace(strip, uncertainty=replace(strip.uncertainty, residuals=()))


def test_held_out_records_lie_within_the_band(fit: Any) -> None:
    found: dict[bool, list[float]] = {True: [], False: []}
    for k, drive in enumerate(["step:1V", "step:-1.5V", "square:-2V..2V,50s", "square:1V,40s", "sine:1V,20mHz"]):
        for whole in found:
            strip = fit.actuator if whole else without(fit.actuator)
            held = record(drive, 10 + k)
            run = ilg.simulate(strip, drive, "100 s", samples=101, engine="exact", band=True, compare=held)
            current = next(part for part in run.compared if part.quantity == "current")
            found[whole].append(current.covered or 0.0)
    assert min(found[True]) >= 0.93, found
    assert np.mean(found[True]) >= 0.95
    assert min(found[False]) < 0.85, found


def test_a_record_outside_is_named(fit: Any) -> None:
    other = replace(PAPER.with_(permittivity=3.0), coupling=PAPER.coupling)
    how: dict[str, Any] = {"samples": 101, "engine": "exact", "band": True}
    run = ilg.simulate(fit.actuator, "step:2V", "100 s", compare=record("step:2V", 3, other), **how)
    assert "record-outside-band" in codes(run.findings)
    assert any("lies outside the 95 % band" in line for line in run.warnings)
    alike = ilg.simulate(fit.actuator, "step:2V", "100 s", compare=record("step:2V", 4), **how)
    assert "record-outside-band" not in codes(alike.findings)


def test_it_is_kept_with_the_fit(fit: Any) -> None:
    (left,) = fit.actuator.uncertainty.residuals
    assert (left.quantity, fit.to_dict()["residuals"][0]["quantity"]) == ("current", "current")
    assert left.correlation > 0.5
    # of the records' own residuals, over 2 V
    assert max(left.deviations) < 2 * np.abs(fit.observations[0].residuals).max() / 2
    assert loads(dumps(fit.actuator)) == fit.actuator


def test_what_it_adds() -> None:
    times = tuple(np.geomspace(1.0, 100.0, 5))
    left = Residuals("current", times, (3e-3, 2.5e-3, 2e-3, 1.5e-3, 1e-3), 0.9)
    assert left.at(np.array([-1.0, 0.1, 10.0, 1e3])) == pytest.approx([0.0, 3e-3, 2e-3, 1e-3])
    strip = replace(PAPER, uncertainty=Uncertainty("rc", ("capacitance",), ((0.0,),), 2.0, (left,)))
    how: dict[str, Any] = {"engine": "exact", "band": True, "beam": "static"}
    step = ilg.simulate(strip, "step:-2V", times=[0.5, 10.0, 100.0], **how).stderr["current"]
    assert step == pytest.approx([6e-3, 4e-3, 2e-3], rel=5e-3)
    # after a jump from 2 V to -2 V: of two steps of opposite sign, that do not cancel
    square = ilg.simulate(strip, "square:-2V..2V,40s", times=[10.0, 30.0], **how).stderr["current"]
    after = np.hypot(4 * 2e-3, 2 * left.at(np.array([30.0]))[0])
    assert square == pytest.approx([4e-3, after], rel=0.05)
    # a drift goes with the time since the onset
    sine = ilg.simulate(strip, "sine:1V,1Hz", times=[10.0, 90.0], **how).stderr["current"]
    assert (sine >= left.at(np.array([10.0, 90.0])) * (1 - 1e-9)).all()
    assert sine.max() < 3e-3
    # of a ramp, all steps since are alike at first
    ramp = ilg.simulate(strip, "ramp:1V/s", times=[0.5], **how).stderr["current"]
    assert ramp == pytest.approx([0.5 * 3e-3], rel=1e-2)
    assert (
        not ilg.simulate(strip, "step:1V", times=[1.0], tip="clamped", engine="exact", band=True)
        .stderr["current"]
        .any()
    )


@pytest.mark.parametrize(
    ("values", "says"),
    [
        (("charge", (1.0,), (1.0,)), "'charge' is no quantity"),
        (("current", (1.0, 2.0), (1.0,)), "two lists of numbers of one length"),
        (("current", (2.0, 1.0), (1.0, 1.0)), "times ascend above zero"),
    ],
)
def test_what_is_wrong_is_one_line(values: Any, says: str) -> None:
    with pytest.raises(InputError, match=says):
        Residuals(*values)
    text = dumps(replace(PAPER, uncertainty=Uncertainty("rc", ("capacitance",), ((0.0,),))))
    with pytest.raises(InputError, match="must have exactly the keys"):
        loads(f"{text}[[uncertainty.residuals]]\nquantity = 'current'\n")
