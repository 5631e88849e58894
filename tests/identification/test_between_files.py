"""Files that have no common port: intervals of the common values reach the files' own, bands hold the scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import record, spectrum, step

from ilg_circuit.findings import codes
from ilg_circuit.identification import Identification, identify
from ilg_circuit.measurements.record import Record
from ilg_circuit.simulation.prediction_band import prediction_band
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements

PLAIN = replace(PAPER, coupling=None)


def other(capacitance: float) -> Actuator:
    material = replace(PLAIN.material, permittivity=capacitance * PLAIN.material.permittivity)
    return replace(PLAIN, material=material)


def measured(strip: Actuator, voltage: float, seed: int) -> Record:
    made = record(step(voltage), 120.0, 241, strip=strip, rest=20, noise=2e-3, seed=seed)
    return made.measurement(f"{seed}.csv")


def of_two(capacitance: float, seed: int = 0) -> Identification:
    files = [measured(PLAIN, 2.0, seed), measured(other(capacitance), 2.0, seed + 100)]
    return identify(files, model="rc", base=PLAIN, engine="exact")


@pytest.mark.parametrize("capacitance", [1.3, 0.8])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_interval_holds_the_capacitances_of_both_strips(capacitance: float, seed: int) -> None:
    found = of_two(capacitance, seed)
    assert "files-inconsistent" in codes(found.findings)
    e = found["capacitance"]
    assert e.interval is not None
    # the files' own intervals miss one time in twenty, by little
    ends = sorted([0.35, 0.35 * capacitance])
    assert e.interval[0] < 1.005 * ends[0]
    assert e.interval[1] > 0.995 * ends[1]
    assert e.stderr is not None
    assert e.stderr > 0.4 * (ends[1] - ends[0])


def test_the_time_constant_has_it_too() -> None:
    found = of_two(1.3)
    truths = [lumped_elements(strip).port.dynamic_resistance * c for strip, c in ((PLAIN, 0.35), (other(1.3), 0.455))]
    low, high = found["time_constant"].interval or (np.nan, np.nan)
    assert low < truths[0] < truths[1] < high


def test_the_band_holds_both_currents() -> None:
    """The band alone, without the misfit of the files: of a step to 2 V, where the two strips differ most."""
    found = of_two(1.3).actuator
    assert found.uncertainty is not None
    times = np.linspace(2.0, 20.0, 10)
    bare = replace(found, uncertainty=replace(found.uncertainty, residuals=()))
    error = prediction_band(bare, step(2.0), times).stderr["current"]
    apart = [lumped_elements(strip).port for strip in (PLAIN, other(1.3))]
    a, b = (2.0 / p.dynamic_resistance * np.exp(-times / (p.dynamic_resistance * p.capacitance)) for p in apart)
    assert (2 * 1.96 * error > np.abs(a - b)).all()


def test_files_of_one_strip_are_as_sure_as_before() -> None:
    found = of_two(1.0)
    assert "files-inconsistent" not in codes(found.findings)
    e = found["capacitance"]
    assert e.stderr is not None
    assert e.stderr < 2e-3 * e.value


def test_a_step_and_a_spectrum_of_two_strips() -> None:
    files = [measured(PLAIN, 2.0, 0), spectrum(other(1.3), 1e-3, 1e2, source="z.csv")]
    found = identify(files, model="rc", base=PLAIN, engine="exact")
    low, high = found["capacitance"].interval or (np.nan, np.nan)
    assert low < 1.005 * 0.35
    assert high > 0.995 * 0.455
