"""The band of a prediction: first-order propagation of the fit's covariance, and what its file may hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.prediction_band import prediction_band, scaled
from ilg_circuit.simulation.response import simulate, transient_band
from ilg_circuit.strip.actuator import PAPER, Actuator, Uncertainty
from ilg_circuit.strip.file import dumps, loads
from ilg_circuit.strip.models import electrical_model

TIMES = np.linspace(0.0, 100.0, 51)
COUPLING_FIELDS = tuple(f"coupling_{name}" for name in ("gain", "zero", "damping_ratio", "natural_frequency"))
DRIVE = PiecewiseLinear.step(2.0)
NAMES = (*electrical_model("rc").names, *COUPLING_FIELDS)


def uncertain(strip: Actuator, model: str, relative: float = 0.01, correlation: float = 0.3) -> Actuator:
    names = (*electrical_model(model).names, *(COUPLING_FIELDS if strip.coupling else ()))
    covariance = relative**2 * (correlation + (1 - correlation) * np.eye(len(names)))
    return replace(strip, uncertainty=Uncertainty(model, names, tuple(map(tuple, covariance.tolist()))))


def test_the_band_is_the_spread_of_strips_drawn_from_the_covariance() -> None:
    strip = uncertain(PAPER, "rc")
    assert strip.uncertainty is not None
    band = prediction_band(strip, DRIVE, TIMES, beam="static", engine="exact")
    rng = np.random.default_rng(3)
    logs = rng.multivariate_normal(np.zeros(len(NAMES)), np.array(strip.uncertainty.covariance), 400)
    drawn = []
    for x in logs:
        moved = scaled(strip, dict(zip(NAMES, np.exp(x), strict=True)), (1e-3, 1.0))
        drawn.append(simulate(moved, DRIVE, TIMES, beam="static", engine="exact"))
    for name in ("current", "displacement"):
        spread = np.std([getattr(r, name) for r in drawn], axis=0)
        # 400 draws know a standard deviation to 3.5 %
        assert band.stderr[name][1:] == pytest.approx(spread[1:], rel=0.15)


def test_the_steady_current_has_the_relative_error_of_rdc() -> None:
    names = electrical_model("rc").names
    covariance = np.diag([0.02**2, 0.0, 0.0])
    strip = replace(PAPER, coupling=None, uncertainty=Uncertainty("rc", names, tuple(map(tuple, covariance.tolist()))))
    times = np.array([0.0, 100.0, 300.0])
    current = simulate(strip, DRIVE, times).current
    band = prediction_band(strip, DRIVE, times)
    assert band.stderr["current"][-1] == pytest.approx(0.02 * current[-1], rel=1e-4)


@pytest.mark.parametrize("model", ["rc", "rc2", "warburg", "cpe", "rc+sinh"])
def test_every_model_has_a_band(strips: dict[str, Actuator], model: str) -> None:
    m = PAPER.material
    strip = {
        "rc": PAPER,
        "rc2": strips["rc2"],
        "warburg": replace(PAPER, material=replace(m, diffusion_time=20.0)),
        "cpe": replace(PAPER, material=replace(m, cpe_exponent=0.8)),
        "rc+sinh": replace(PAPER, material=replace(m, emission_voltage=1.0)),
    }[model]
    band = prediction_band(uncertain(strip, model), DRIVE, TIMES)
    assert (band.stderr["current"] > 0).all()
    assert (band.stderr["displacement"][1:] > 0).all()


@pytest.mark.parametrize("model", ["rc", "rc2", "warburg", "cpe", "rc+sinh", "rc+growing"])
def test_values_are_the_inverse_of_port(model: str) -> None:
    kind = electrical_model(model)
    values = tuple(0.3 + 0.05 * k for k in range(len(kind.parameters)))
    assert kind.values(kind.port(values)) == pytest.approx(values, rel=1e-14)


def test_scaling_by_nothing_changes_nothing() -> None:
    strip = uncertain(PAPER, "rc")
    band = transient_band(TIMES)
    a = simulate(scaled(strip, {}, band), DRIVE, TIMES, engine="exact")
    b = simulate(strip, DRIVE, TIMES, engine="exact")
    assert a.current == pytest.approx(b.current, rel=1e-12)
    assert a.displacement == pytest.approx(b.displacement, abs=1e-12 * np.abs(b.displacement).max())


def test_the_file_keeps_it() -> None:
    strip = uncertain(PAPER, "rc")
    assert loads(dumps(strip)) == strip


BROKEN = {
    "not square": ('covariance = [[1.0, 0.0]]', "table of 1 by 1"),
    "text": ('covariance = [["1"]]', "give numbers without units"),
    "no rows": ("covariance = 3", "list of rows"),
    "infinite": ("covariance = [[inf]]", "finite and symmetric"),
    "negative": ("covariance = [[-1.0]]", "no negative diagonal"),
    "missing": ("", "exactly the keys"),
}  # fmt: skip


@pytest.mark.parametrize(("line", "message"), BROKEN.values(), ids=BROKEN)
def test_a_broken_covariance_is_refused(line: str, message: str) -> None:
    text = f'{dumps(PAPER)}\n[uncertainty]\nmodel = "rc"\nnames = ["dc_resistance"]\n{line}\n'
    with pytest.raises(InputError, match=message):
        loads(text)


def test_a_strip_that_was_not_fitted_has_no_band() -> None:
    with pytest.raises(InputError, match="has no \\[uncertainty\\]"):
        prediction_band(PAPER, DRIVE, TIMES)


def test_a_name_of_another_model_is_refused() -> None:
    strip = replace(PAPER, uncertainty=Uncertainty("rc", ("resistance_2",), ((1.0,),)))
    with pytest.raises(InputError, match="names 'resistance_2'"):
        prediction_band(strip, DRIVE, TIMES)
