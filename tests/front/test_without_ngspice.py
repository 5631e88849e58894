"""Without ngspice's library the exact engine solves what is linear, said aloud; the rest says what to install."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.commands.simulate import simulate as command
from ilg_circuit.errors import MissingLibraryError
from ilg_circuit.solve.library import VARIABLE

SAID = "solved by the exact engine, since "


@pytest.fixture(autouse=True)
def no_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "none")
    monkeypatch.setattr("ilg_circuit.solve.ngspice._sessions", [])  # another test may have loaded it


def nonlinear() -> ilg.results.Actuator:
    paper = ilg.load("paper")
    return replace(paper, material=replace(paper.material, emission_voltage=1.0))


def record() -> dict[str, np.ndarray]:
    time = np.arange(-5.0, 60.0, 0.5)
    random = np.random.default_rng(7)
    current = np.where(time < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-time / 7)) + random.normal(0, 1e-4, len(time))
    return {"time": time, "voltage": np.where(time < 0, 0.0, 4.0), "current": current}


def test_a_run_an_impedance_and_a_signal_are_exact() -> None:
    with pytest.warns(ilg.IlgWarning, match=SAID), pytest.warns(ilg.IlgWarning, match="not compared with ngspice: "):
        run = ilg.simulate("paper", "step:4V", "60 s", samples=20, beam="static", check=True)
    assert run.engine == "exact"
    assert {check.reference for check in run.checks} == {"closed form"}
    with pytest.warns(ilg.IlgWarning, match=SAID), pytest.warns(ilg.IlgWarning, match="not compared with ngspice: "):
        spectrum = ilg.impedance(nonlinear(), "1 mHz", "10 Hz", points=5, check=True)
    assert spectrum.engine == "exact"
    assert [check.reference for check in spectrum.checks] == ["closed form"]
    with pytest.warns(ilg.IlgWarning, match=SAID):
        assert ilg.sense("paper", "sine:1mm,0.1Hz", "20 s", samples=20).engine == "exact"


def test_a_fit_is_exact_and_one_of_spectra_needs_no_word() -> None:
    with pytest.warns(ilg.IlgWarning, match=SAID):
        fit = ilg.identify(**record(), model="rc", onset="first-level")
    assert fit.engine == fit.to_dict()["engine"] == "exact"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        f = np.geomspace(1e-3, 10, 30)
        z = 1 / (1 / 600 + 1 / (20 + 1 / (0.35 * 2j * np.pi * f))) * (1 + 1e-3 * np.sin(50 * np.arange(30)))
        ilg.identify(frequency=f, impedance=z, model="rc")


def test_many_strips_and_the_best_one_are_exact() -> None:
    pytest.importorskip("loky", reason="an extra of the package")
    with pytest.warns(ilg.IlgWarning, match=SAID):
        found = ilg.sweep("paper", "step:4V", "300 s", {"thickness": ("0.4 mm", "0.6 mm", 3)}, jobs=1)
    assert np.isfinite(found.to_xarray().displacement_final).all()
    with pytest.warns(ilg.IlgWarning, match=SAID):
        report = ilg.design(
            "paper", "step:4V", "300 s", {"thickness": ("0.2 mm", "1 mm")}, maximise="displacement_final"
        )
    assert report.design is not None
    assert report.design.referee == "exact"
    assert "simulated again by exact" in report.summary()


def test_what_is_asked_for_by_name_or_nonlinear_says_what_to_do() -> None:
    with pytest.raises(MissingLibraryError, match="which hides ngspice's library; unset it"):
        ilg.simulate("paper", "step:4V", "60 s", engine="ngspice")
    with pytest.raises(MissingLibraryError, match="a nonlinear circuit needs ngspice; "):
        ilg.simulate(nonlinear(), "step:4V", "60 s")
    with pytest.raises(MissingLibraryError, match="a nonlinear circuit needs ngspice; "):
        ilg.identify(**record(), model="rc+sinh", onset="first-level")


def test_the_command_says_it_in_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "run.csv")
    command.main(["paper", "--drive", "step:4V", "--duration", "60s", "--out", out], standalone_mode=False)
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if line.startswith("warning: solved by the exact engine, since ")] == said
