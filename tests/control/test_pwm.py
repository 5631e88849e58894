"""A stage that switches and voltages that come late by chance: against switches one by one, the ripple, refusals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run, assert_one_line

import ilg_circuit as ilg
from ilg_circuit.control.plant import plants_of
from ilg_circuit.control.pwm import Pwm
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import PAPER


class Ramp:
    """Voltages that do not ask what was measured."""

    def __init__(self) -> None:
        self.calls = 0

    def step(self, reference: float, measured: float) -> float:
        self.calls += 1
        return 0.37 * self.calls - 2.0


def closed(controller: Any = None, **changed: Any) -> Any:
    asked: dict[str, Any] = {"period": "1 s", "samples": 41, "engine": "exact", "beam": "dynamic"} | changed
    return ilg.close_loop("paper", controller or Ramp(), "step:1mm", "10 s", **asked)


def switches(late: float = 0.0, cycle: float = 0.125, supply: float = 5.0, steps: int = 32) -> Any:
    """The same voltage as a drive: every switch by itself."""
    times, values = [0.0], [0.0]
    for k in range(round(10 / cycle)):
        call = int(np.floor(k * cycle - late + 1e-9))
        asked = min(max(0.37 * (call + 1) - 2.0, -4.0), 4.0) if call >= 0 else 0.0
        duty = np.floor(abs(asked) / supply * steps + 1e-6) / steps
        for at, value in ((0.0, supply * np.sign(asked) * (duty > 0)), (duty * cycle, 0.0)):
            times += [k * cycle + at] * 2
            values += [values[-1], value]
    return np.array(times), np.array(values)


def test_the_stage_is_its_switches_one_by_one() -> None:
    for late in (0.0, 0.3):  # a new duty comes at the next cycle
        found = closed(pwm="8 Hz", supply="5 V", duty_steps=32, computation=late)
        times, values = switches(late)
        drive = PiecewiseLinear(times, values)
        run = ilg.simulate(PAPER, drive, times=found.time, beam="dynamic", engine="exact")
        np.testing.assert_allclose(found.displacement, run.displacement, atol=1e-9 * np.abs(run.displacement).max())


def test_many_cycles_are_their_mean_within_the_ripple() -> None:
    plant = plants_of(PAPER, beam="static")[0]
    for frequency, limit in ((50.0, 4e-3), (1000.0, 2e-4)):
        stage = Pwm(frequency, 4.0, 2**20)
        found = closed(pwm=frequency, duty_steps=2**20, beam="static")
        mean = closed(beam="static")
        assert found.ripple == stage.ripple(plant)
        off = np.abs(found.displacement - mean.displacement).max()
        assert off < 2 * found.ripple  # a cycle begins high, which is its part of the cycle too early
        assert found.ripple < limit * np.abs(mean.displacement).max()
    # half a cycle at half duty: y' = b0 u goes by b0 (4 V/2)/(2 f), half of it to either side of the mean
    degree, b0 = plant.leading()
    assert degree == 1
    assert stage.ripple(plant) == pytest.approx(b0 * 2.0 / (2 * frequency) / 2, rel=1e-2)


def test_the_duty_has_steps() -> None:
    few = closed(pwm="1 kHz", duty_steps=10)
    np.testing.assert_allclose(few.voltage / 0.4, np.round(few.voltage / 0.4), atol=1e-12)
    assert len(np.unique(few.voltage)) > 5


@pytest.mark.parametrize("engine", ["exact", "ngspice"])
def test_jitter_moves_voltages_and_not_calls(engine: str) -> None:
    found = closed(jitter="0.4 s", computation="0.1 s", seed=3, engine=engine)
    draws = np.random.default_rng(3)
    draws.standard_normal(11)
    at = np.arange(11) + 0.1 + 0.4 * draws.random(11)
    values = np.clip(0.37 * np.arange(1, 12) - 2.0, -4, 4)
    drive = PiecewiseLinear(
        np.repeat(np.append(0, at[:10]), 2), np.append(0, np.repeat(np.append(0, values[:10]), 2)[:-1])
    )
    run = ilg.simulate(PAPER, drive, times=found.time, beam="dynamic", engine="exact")
    tolerance = 1e-9 if engine == "exact" else 2e-6
    np.testing.assert_allclose(found.displacement, run.displacement, atol=tolerance * np.abs(run.displacement).max())


def test_bad_input_is_told_in_a_line() -> None:
    for wrong, said in (
        ({"pwm": "0 Hz"}, "pwm is 0 Hz"),
        ({"pwm": "1 kHz", "supply": "3 V"}, "below the limit of the voltage, 4 V"),
        ({"pwm": "1 kHz", "duty_steps": 1}, "give 2 to 2\\^24"),
        ({"pwm": "1 kHz", "engine": "ngspice"}, "engine='exact'"),
        ({"jitter": "1 s"}, "shorter than the period"),
        ({"jitter": "-1 ms"}, "neither may be negative"),
    ):
        with pytest.raises(InputError, match=said):
            closed(**wrong)


def test_the_command(run: Run, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("def step(reference, measured):\n    return 4e3 * (reference - measured)\n")
    asked = (
        "close",
        "paper",
        "--controller",
        "own.py",
        "--reference",
        "step:1mm",
        "--duration",
        "20s",
        "--period",
        "0.5s",
    )
    done = run(*asked, "--pwm", "1kHz", "--supply", "5V", "--jitter", "20ms", "--json", "c.json")
    assert done.code == 0, done.err
    assert "5 V at 1 kHz in 256 steps" in done.out
    found = json.loads((tmp_path / "c.json").read_text())["pwm"]
    assert found["ripple"] > 0
    assert_one_line(run(*asked, "--pwm", "1kHz", "--supply", "2V"), "below the limit")
