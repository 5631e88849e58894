"""The spectrum at the terminals: as a function, as a command and as a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from every_model import MODELS, port_of, strip_of, strongly_coupled

from ilg_circuit.circuit import Load
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.check import check_impedance, require_agreement
from ilg_circuit.simulation.impedance import frequencies, impedance
from ilg_circuit.strip.actuator import PAPER, Actuator

F = np.geomspace(1e-3, 10, 9)
S = 2j * np.pi * F


def free(strip: Actuator) -> Actuator:
    """Without a band of its own, so that the ladder's follows the question."""
    return replace(strip, material=replace(strip.material, ladder_lowest=None, ladder_highest=None))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_every_model_is_its_formula(model: str, engine: str) -> None:
    """Of the ideal elements, within what the ladder states."""
    found = impedance(free(strip_of(model, 5.0)), F, engine=engine)
    expected = port_of(model, 5.0).impedance(S, ideal=True)
    error = found.ladder.error if found.ladder else 0.0
    assert found.impedance == pytest.approx(expected, rel=error + 1e-8, abs=0)
    assert found.port == pytest.approx(expected, rel=error + 1e-12, abs=0)
    assert found.reflected < 1e-7
    assert found.engine == engine


@pytest.mark.parametrize("model", ["rc+sinh", "rc2+growing+sinh"])
@pytest.mark.parametrize("bias", [2.0, -2.0])
def test_engines_agree_about_a_bias(model: str, bias: float) -> None:
    strip = strip_of(model, 5.0)
    found = impedance(strip, F, bias=bias)
    assert found.impedance == pytest.approx(impedance(strip, F, bias=bias, engine="exact").impedance, rel=1e-9)
    assert found.impedance == pytest.approx(impedance(strip, F, bias=-bias).impedance, rel=1e-9)
    assert np.abs(found.impedance / impedance(strip, F).impedance - 1).max() > 0.05
    require_agreement(check_impedance(found, bias=bias))


@pytest.mark.parametrize("tip", ["free", "clamped"])
@pytest.mark.parametrize("model", ["rc", "rc2+growing", "cpe"])
def test_check_knows_what_the_motion_reflects(model: str, tip: str) -> None:
    """On a stiff, strongly coupled strip the reflection is no disagreement."""
    strip = strongly_coupled(free(strip_of(model, 5.0)))
    for load in (None, Load(mass=1e-4, stiffness=10.0, damping=1e-3)) if tip == "free" else (None,):
        found = impedance(strip, F, tip=tip, bias=1.0, load=load)
        require_agreement(check_impedance(found, tip=tip, bias=1.0, load=load))
    if tip == "clamped":
        assert found.reflected > 1e-3
        wrong = replace(found, impedance=found.impedance * 1.001)
        assert not all(d.agrees for d in check_impedance(wrong, tip=tip, bias=1.0))


def test_a_band_beyond_the_ladder_s_is_refused() -> None:
    strip = free(strip_of("warburg"))
    narrow = replace(strip, material=replace(strip.material, ladder_lowest=1e-2, ladder_highest=10.0))
    impedance(narrow, [1e-2, 10.0])
    for f in ([0.99e-2, 1.0], [1.0, 10.1]):
        with pytest.raises(InputError, match="reaches beyond the ladder's band, 10 mHz to 10 Hz"):
            impedance(narrow, f)
    wide = impedance(strip, [1e-6, 1e6])
    assert wide.ladder is not None
    assert wide.ladder.band[0] < 1e-6
    assert wide.ladder.band[1] > 1e6
    assert wide.ladder.error <= 1.03e-4


@pytest.mark.parametrize("frequency", [[], [0.0, 1.0], [1.0, np.nan], [[1.0]]])
def test_frequencies_that_are_none(frequency: object) -> None:
    with pytest.raises(InputError, match="at least one frequency, all positive and finite"):
        impedance(PAPER, frequency)  # type: ignore[arg-type]


@pytest.mark.parametrize("bias", [np.nan, np.inf])
def test_a_bias_that_is_none(bias: float) -> None:
    with pytest.raises(InputError, match="give a finite voltage"):
        impedance(PAPER, F, bias=bias)


def test_frequencies_are_even_in_logarithm() -> None:
    f = frequencies(1e-3, 1e4)
    assert len(f) == 71
    assert np.diff(np.log10(f)) == pytest.approx(np.full(70, 0.1))
    assert frequencies(1.0, 2.0, 2).tolist() == [1.0, 2.0]
    for low, high, points in ((1.0, 1.0, None), (2.0, 1.0, None), (0.0, 1.0, None), (1.0, np.inf, None)):
        with pytest.raises(InputError, match="give two frequencies above zero, the lower one first"):
            frequencies(low, high, points)
    for points in (1, 0, -5, 100_001):
        with pytest.raises(InputError, match="give 2 to 100000"):
            frequencies(1.0, 2.0, points)
