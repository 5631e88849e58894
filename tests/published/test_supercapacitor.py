"""Spectra of a carbon supercapacitor, third-party data that lie beside the project: ions that diffuse."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ilg_circuit.findings import codes
from ilg_circuit.identification import Identification, identify
from ilg_circuit.identification.impedance import ImpedanceData
from ilg_circuit.measurements.read import read_spectrum
from ilg_circuit.strip.models import electrical_model

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "eis_supercap"
FILES = ("eis_0V5_fresh.txt", "eis_ocv_fresh.txt")

pytestmark = pytest.mark.skipif(
    not all((DATA / name).is_file() for name in FILES), reason="the shared measurements are not beside the project"
)


@pytest.fixture(scope="module", params=FILES)
def found(request: pytest.FixtureRequest) -> Identification:
    return identify(read_spectrum(DATA / request.param))


def data(found: Identification) -> ImpedanceData:
    (only,) = found.port.data
    assert isinstance(only, ImpedanceData)
    return only


def test_file(found: Identification) -> None:
    spectrum = data(found).spectrum
    assert len(spectrum.frequency) == 43
    assert spectrum.impedance.imag.max() < 0  # the column holds -Im Z
    assert "1 point from 200 kHz on, where Im Z is positive" in str(spectrum.notes[0])


def test_it_is_linear_and_steady(found: Identification) -> None:
    assert found.check is not None
    assert found.check.consistent
    assert found.check.rms < 0.003


def test_a_finite_warburg_element_beats_one_pole(found: Identification) -> None:
    rms = {c.model: c.relative_rms for c in found.candidates}
    assert rms["rc"] == pytest.approx(0.165, abs=0.005)
    assert rms["rc2"] == pytest.approx(0.093, abs=0.005)
    assert rms["warburg"] == pytest.approx(0.070, abs=0.005)
    assert found.model == "warburg"
    assert found.parameters["diffusion_time"].value == pytest.approx(0.39, abs=0.02)
    assert found.derived["diffusion_capacitance"].value == pytest.approx(0.104, abs=0.004)


def test_no_electron_path_is_claimed(found: Identification) -> None:
    for model in ("rc", "rc2", "warburg"):
        assert "dc_resistance" in data(found).individual(electrical_model(model), 0.0, None).fixed
    held = found.parameters["dc_resistance"]
    assert held.stderr is None
    # 397 and 376 ohm: the residuals of a model that leaves 7 % are few independent samples
    least = re.search(r"practically an open circuit, more than (\d+) ohm", held.fixed_because)
    assert least is not None
    assert float(least[1]) == pytest.approx(386.5, rel=0.03)
    assert any("dc_resistance: no electron path is seen" in line for line in found.warnings)


def test_what_the_model_does_not_describe_is_said(found: Identification) -> None:
    assert {"spectrum-misfit", "residuals-autocorrelated", "electron-path-open"} <= codes(found.findings)
    assert found.parameters["diffusion_time"].autoregression is not None


# -- an interface and diffusion with a free exponent: relative rms of the complex residuals, sqrt(2) of each part's ----


@pytest.mark.parametrize("name", FILES)
def test_randles_describes_it_within_a_few_per_cent(name: str) -> None:
    spectrum = read_spectrum(DATA / name)
    plain, leads = (identify(spectrum, model=model) for model in ("randles", "randles+inductance"))
    # sqrt(2) of each part's rms; 2.6 % with the point whose Im Z is positive
    assert plain.statistics["relative_rms"] * 2**0.5 == pytest.approx(0.0155, abs=0.001)
    assert leads.statistics["relative_rms"] * 2**0.5 == pytest.approx(0.0097, abs=0.0005)
    for found in (plain, leads):
        assert "electron-path-open" in codes(found.findings)
        assert found.statistics["identifiability"]["determined"]
        assert found.parameters["diffusion_exponent"].value == pytest.approx(0.4742, abs=0.001)
        assert found.statistics["starts_agreeing"] > 1
    assert plain.parameters["series_resistance"].value == pytest.approx(0.807, abs=0.005)
    assert leads.parameters["series_resistance"].value == pytest.approx(0.681, abs=0.01)
    assert leads.parameters["inductance"].value == pytest.approx(1.11e-7, rel=0.03)


def test_the_model_that_describes_it_is_named(found: Identification) -> None:
    (said,) = (f for f in found.findings if f.code == "richer-model-untried")
    assert "randles" in str(said)
