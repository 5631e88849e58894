"""The check passes what a linear, steady strip answers, and finds what one cannot."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.identification.kramers_kronig import kramers_kronig
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.strip.models import electrical_model

F = np.geomspace(1e-3, 1e4, 71)
STRIPS = {
    "rc": (233.0, 6.8, 0.02),
    "rc2": (400.0, 20.0, 0.01, 100.0, 0.02),
    "warburg": (300.0, 10.0, 50.0, 2.0),
    "cpe": (1000.0, 10.0, 0.02, 0.8),
}


def impedance(model: str) -> NDArray[np.complex128]:
    return electrical_model(model).port(STRIPS[model], 2.0).impedance(2j * np.pi * F, ideal=True)


def noisy(z: NDArray[np.complex128], size: float, seed: int = 0) -> NDArray[np.complex128]:
    random = np.random.default_rng(seed)
    return z * (1 + size * (random.standard_normal(len(z)) + 1j * random.standard_normal(len(z))))


@pytest.mark.parametrize("model", STRIPS)
def test_clean_and_noisy_strips_pass(model: str) -> None:
    clean = kramers_kronig(Spectrum("s", F, impedance(model)))
    assert clean.consistent
    assert clean.rms < 1e-4
    found = kramers_kronig(Spectrum("s", F, noisy(impedance(model), 0.003)))
    assert found.consistent
    assert not found.bad.any()
    assert found.rms == pytest.approx(0.003, rel=0.25)


@pytest.mark.parametrize("model", STRIPS)
def test_bad_points_are_named(model: str) -> None:
    z = noisy(impedance(model), 0.003)
    z[[20, 45]] *= 1.1
    found = kramers_kronig(Spectrum("s", F, z))
    assert np.flatnonzero(found.bad).tolist() == [20, 45]
    (finding,) = found.findings
    assert (finding.code, finding.values["count"]) == ("kramers-kronig-points", 2)
    assert finding.values["frequencies_Hz"] == pytest.approx([0.1, 10**1.5])
    assert "100 mHz (" in str(finding)
    assert finding.values["sizes"] == pytest.approx([0.1 / 1.1] * 2, abs=0.01)
    assert found.rms == pytest.approx(0.003, rel=0.25)


@pytest.mark.parametrize("model", STRIPS)
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_parts_that_do_not_belong_together_are_found(model: str, noise: float) -> None:
    z = impedance(model)
    found = kramers_kronig(Spectrum("s", F, noisy(z.real + 1.1j * z.imag, noise)))
    assert not found.consistent
    assert found.rms > 0.01


def test_a_strip_that_drifts_is_found() -> None:
    """Rdc and C change by 60 % in the course of the sweep."""
    kind = electrical_model("rc")
    drift = np.linspace(1.6, 1.0, len(F))
    z = [kind.port((233.0 * d, 6.8, 0.02 * d)).impedance(2j * np.pi * f) for d, f in zip(drift, F, strict=True)]
    assert kramers_kronig(Spectrum("s", F, np.array(z))).rms < 0.02  # a slow drift alone hardly breaks them
    jump = np.where(np.arange(len(F)) < 30, 1.6, 1.0)  # while Im Z still counts
    z = [kind.port((233.0 * d, 6.8, 0.02 * d)).impedance(2j * np.pi * f) for d, f in zip(jump, F, strict=True)]
    found = kramers_kronig(Spectrum("s", F, np.array(z)))
    assert not found.consistent
    assert "kramers-kronig-residuals" in codes(found.findings)
    assert "drifted" in str(found.findings[-1])


def test_many_outliers_are_no_exceptions() -> None:
    z = noisy(impedance("rc2"), 0.002)
    z[::4] *= 1.3
    found = kramers_kronig(Spectrum("s", F, z))
    assert not found.consistent
    assert found.rms > 0.01


def test_too_few_points() -> None:
    with pytest.raises(InputError, match="needs 6"):
        kramers_kronig(Spectrum("s", F[:5], impedance("rc")[:5]))
