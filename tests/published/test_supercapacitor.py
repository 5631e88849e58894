"""Spectra of a carbon supercapacitor, third-party data that lie beside the project: ions that diffuse."""

from __future__ import annotations

from pathlib import Path

import pytest
from ilg_circuit.identify.spectrum_fit import SpectrumFit, fit_spectrum

from ilg_circuit.identify import SpectrumIdentification, identify_spectrum, read_spectrum

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "eis_supercap"
FILES = ("eis_0V5_fresh.txt", "eis_ocv_fresh.txt")

pytestmark = pytest.mark.skipif(
    not all((DATA / name).is_file() for name in FILES), reason="the shared measurements are not beside the project"
)


@pytest.fixture(scope="module", params=FILES)
def found(request: pytest.FixtureRequest) -> SpectrumIdentification:
    return identify_spectrum(read_spectrum(DATA / request.param))


def fits(found: SpectrumIdentification) -> dict[str, SpectrumFit]:
    return {c.model: c.fit for c in found.candidates if c.fit}


def test_file(found: SpectrumIdentification) -> None:
    f = found.spectrum.frequency
    assert len(f) == 43
    assert found.spectrum.impedance.imag.max() < 0  # the column holds -Im Z
    assert "1 point from 200 kHz on, where Im Z is positive" in found.spectrum.notes[0]


def test_it_is_linear_and_steady(found: SpectrumIdentification) -> None:
    assert found.check.consistent
    assert found.check.rms < 0.003


def test_a_finite_warburg_element_beats_one_pole(found: SpectrumIdentification) -> None:
    made = fits(found)
    assert made["rc"].relative_rms == pytest.approx(0.165, abs=0.005)
    assert made["rc2"].relative_rms == pytest.approx(0.093, abs=0.005)
    assert made["warburg"].relative_rms == pytest.approx(0.070, abs=0.005)
    assert found.model == "warburg"
    assert found.parameters["diffusion_time"].value == pytest.approx(0.39, abs=0.02)
    assert found.derived["diffusion_capacitance"].value == pytest.approx(0.104, abs=0.004)


def test_no_electron_path_is_claimed(found: SpectrumIdentification) -> None:
    for fit in fits(found).values():
        assert fit.open_circuit
    held = found.parameters["dc_resistance"]
    assert held.stderr is None
    assert "practically an open circuit, more than 7" in held.held
    assert any("dc_resistance: no electron path is seen" in line for line in found.warnings)


def test_what_the_model_leaves_is_said(found: SpectrumIdentification) -> None:
    told = "\n".join(found.warnings)
    assert "the model is not all that is there" in told
    assert "those of a block bootstrap are given" in told
    assert found.parameters["diffusion_time"].bootstrap is not None


# -- an interface and diffusion with a free exponent: relative rms of the complex residuals, sqrt(2) of each part's ----


def complex_rms(fit: SpectrumFit) -> float:
    return fit.relative_rms * 2**0.5


@pytest.mark.parametrize("name", FILES)
def test_randles_describes_it_within_a_few_per_cent(name: str) -> None:
    spectrum = read_spectrum(DATA / name)
    plain, leads = (fit_spectrum(spectrum, model) for model in ("randles", "randles+inductance"))
    assert complex_rms(plain) == pytest.approx(0.0155, abs=0.001)  # 2.6 % with the point whose Im Z is positive
    assert complex_rms(leads) == pytest.approx(0.0097, abs=0.0005)
    for fit in (plain, leads):
        assert fit.open_circuit
        assert fit.undetermined == ()
        assert fit.values["diffusion_exponent"] == pytest.approx(0.4742, abs=0.001)
        assert fit.agreeing > 1
    assert plain.values["series_resistance"] == pytest.approx(0.807, abs=0.005)
    assert leads.values["series_resistance"] == pytest.approx(0.681, abs=0.01)
    assert leads.values["inductance"] == pytest.approx(1.11e-7, rel=0.03)
