"""--check: three answers compared, and what is said when they differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.circuit import Load
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import SolveError
from ilg_circuit.report.check import summary
from ilg_circuit.simulation.check import AGREEMENT, Difference, check, closed_forms, require_agreement
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator

T = np.linspace(0, 100, 77)
DRIVES = ["step:4V", "square:4V,30s", "square:-4V..4V,23s,0.3", "sine:2V,0.1Hz", "ramp:20mV/s"]


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("beam", ["dynamic", "static"])
@pytest.mark.parametrize("tip", ["free", "clamped"])
def test_three_answers_agree(drive: str, beam: str, tip: str) -> None:
    response = simulate(PAPER, parse_drive(drive, 100.0), T, tip=tip, beam=beam)
    differences = check(response, tip=tip, beam=beam)
    assert all(d.value <= 1e-7 for d in differences), summary(differences)
    require_agreement(differences)
    references = {d.reference for d in differences}
    assert references == ({"exact engine", "closed form"} if beam == "static" else {"exact engine"})


@pytest.mark.parametrize("which", ["electrodes", "rc2", "rc2 electrodes", "no coupling", "load inside"])
def test_every_kind_of_strip(strips: dict[str, Actuator], which: str) -> None:
    response = simulate(strips[which], parse_drive("step:4V", 100.0), T, beam="static")
    differences = check(response, tip="free", beam="static")
    assert all(d.value <= 1e-7 for d in differences), summary(differences)
    forms = {d.quantity for d in differences if d.reference == "closed form"}
    expected = {
        "electrodes": {"current"},
        "rc2": {"current", "displacement"},
        "rc2 electrodes": set(),
        "no coupling": {"current"},
        "load inside": {"current", "displacement"},
    }
    assert forms == expected[which]


def test_an_exact_response_is_compared_with_ngspice() -> None:
    response = simulate(PAPER, parse_drive("step:4V", 100.0), T, engine="exact")
    differences = check(response, tip="free", beam="dynamic")
    assert {d.reference for d in differences} == {"ngspice engine"}
    require_agreement(differences)


def test_a_load_is_compared_with_the_same_load() -> None:
    load = Load(mass=1e-4, stiffness=1e-4)
    response = simulate(PAPER, parse_drive("step:4V", 100.0), T, load=load)
    require_agreement(check(response, tip="free", beam="dynamic", load=load))
    with pytest.raises(SolveError):
        require_agreement(check(response, tip="free", beam="dynamic"))


def test_a_measured_drive_has_closed_forms_too(tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    times = np.arange(60) * 1.5
    rows = "\n".join(f"{t!r},{v!r}" for t, v in zip(times.tolist(), random.normal(1, 0.5, 60).tolist(), strict=True))
    (tmp_path / "drive.csv").write_text("time_s,voltage_V\n" + rows + "\n")
    response = simulate(PAPER, parse_drive(f"file:{tmp_path / 'drive.csv'}", 100.0), T, beam="static")
    differences = check(response, tip="free", beam="static")
    assert {d.reference for d in differences} == {"exact engine", "closed form"}
    assert all(d.value <= 1e-7 for d in differences), summary(differences)


@pytest.mark.parametrize("duration", [45.0, 75.0])
def test_runs_that_end_on_an_edge(duration: float) -> None:
    t = np.linspace(0, duration, 91)
    response = simulate(PAPER, parse_drive("square:4V,30s", duration), t, beam="static")
    differences = check(response, tip="free", beam="static")
    assert all(d.value <= 1e-7 for d in differences), summary(differences)


@pytest.mark.parametrize("period", ["0.1s", "1.1s"])
def test_samples_that_all_but_hit_an_edge(period: str) -> None:
    duration = 20 * float(period[:-1])
    response = simulate(PAPER, parse_drive(f"square:4V,{period}", duration), np.linspace(0, duration, 401))
    require_agreement(check(response, tip="free", beam="dynamic"))


def test_closed_forms_of_lines_with_jumps() -> None:
    """Jumps, bends and a start above zero, put together by superposition."""
    drive = PiecewiseLinear([0, 5, 5, 20, 20, 20, 40], [1, 2, -1, -1, 0, 3, 0.5])
    response = simulate(PAPER, drive, T, beam="static", engine="exact")
    forms = closed_forms(response, tip="free", beam="static")
    assert set(forms) == {"current", "displacement"}
    for name, values in forms.items():
        assert getattr(response, name) == pytest.approx(values, abs=1e-10 * np.abs(values).max())


def test_closed_force_of_a_clamped_tip() -> None:
    response = simulate(PAPER, parse_drive("step:4V", 100.0), T, beam="static", tip="clamped", engine="exact")
    forms = closed_forms(response, tip="clamped", beam="static")
    assert set(forms) == {"current", "force"}
    assert response.force == pytest.approx(forms["force"], abs=1e-10 * forms["force"].max())


def test_a_wrong_answer_is_named() -> None:
    response = simulate(PAPER, parse_drive("step:4V", 100.0), T, beam="static")
    wrong = response.with_waveforms(charge=1.001 * response.charge)
    differences = check(wrong, tip="free", beam="static")
    with pytest.raises(SolveError, match=r"check failed: charge differs from the exact engine by 1\.0e-03"):
        require_agreement(differences)


@pytest.mark.parametrize("spoilt", ["current", "displacement"])
def test_closed_forms_catch_what_the_engine_might_share(spoilt: str) -> None:
    response = simulate(PAPER, parse_drive("step:4V", 100.0), T, beam="static")
    wrong = response.with_waveforms(
        **{spoilt: getattr(response, spoilt) + 1e-3 * np.abs(getattr(response, spoilt)).max()}
    )
    differences = check(wrong, tip="free", beam="static")
    assert [d for d in differences if d.quantity == spoilt and d.reference == "closed form" and not d.agrees]


def test_a_waveform_that_should_be_zero_is_compared_as_it_is() -> None:
    response = simulate(PAPER, parse_drive("step:4V", 100.0), T)
    wrong = response.with_waveforms(force=np.full(len(T), 1e-3))
    assert not next(d for d in check(wrong, tip="free", beam="dynamic") if d.quantity == "force").agrees


def test_report_is_a_table() -> None:
    rows = [Difference("current", "exact engine", 1e-9), Difference("displacement", "closed form", 2e-4)]
    lines = summary(rows).splitlines()
    assert lines[0].split()[0] == "quantity"
    assert lines[1].split() == ["current", "exact", "engine", "1.0e-09"]
    assert lines[2].split() == ["displacement", "closed", "form", "2.0e-04"]
    assert "no closed form" not in summary(rows)
    assert "no closed form" in summary([rows[0], Difference("displacement", "exact engine", 1e-9)])
    assert "no closed form" not in summary(rows[:1]), "of an impedance nobody expects a displacement"


def test_the_limit_of_agreement() -> None:
    assert Difference("x", "y", AGREEMENT).agrees
    assert not Difference("x", "y", 1.01 * AGREEMENT).agrees
    assert not Difference("x", "y", float("nan")).agrees
