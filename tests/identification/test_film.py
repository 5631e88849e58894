"""A displacement alone under a drive that is stated: the coupling and how late the camera's clock reads."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line

import ilg_circuit as ilg
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.front.data import sets_of
from ilg_circuit.measurements.film import Film
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.elements import lumped_port
from ilg_circuit.strip.file import load_strip

assert ilg.PAPER.coupling is not None
TRUTH = {f"coupling_{name}": getattr(ilg.PAPER.coupling, name) for name in ("gain", "zero", "natural_frequency")}
SIZES = {"length": 0.035, "free_length": 0.03, "width": 0.005, "thickness": 0.0005}
PULSE = PiecewiseLinear(np.array([0.0, 30.0, 30.0, 90.0]), np.array([2.0, 2.0, 0.0, 0.0]))


def film(drive: PiecewiseLinear, late: float = 12.3, seed: int = 1, rate: float = 2.5) -> dict[str, np.ndarray]:
    """Readings of a camera whose clock reads by ``late`` [s] more than the drive's."""
    t = np.arange(-6.0, 80.0, 1 / rate)
    moved = np.zeros(len(t))
    moved[t >= 0] = simulate(ilg.PAPER, drive, t[t >= 0], engine="exact", beam="static").displacement
    moved += 5e-3 * np.ptp(moved) * np.random.default_rng(seed).standard_normal(len(t))
    return {"time_s": t + late, "displacement_m": moved}


STEP, AFTER = film(PiecewiseLinear.step(2.0)), film(PULSE, 20.5, 2)


def write(name: str, columns: dict[str, np.ndarray]) -> None:
    rows = np.column_stack(list(columns.values()))
    np.savetxt(name, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")


def test_a_camera_and_a_stated_drive_give_coupling_and_delay(run: Run) -> None:
    write("tip.csv", {"time_s": STEP["time_s"], "x_px": 300 + STEP["displacement_m"] / 42e-6})
    how = ("--drive", "step:2V", "--scale", "0.042mm/px", "--engine", "exact", "--actuator", "paper")
    done = run("identify", "tip.csv", *how, "--json", "fit.json", "--out", "fitted.toml")
    assert done.code == 0, done.err
    assert "displacement under step 2 V, as stated; coupling d(s), static beam" in done.out
    assert "displacement_delay" in done.out
    assert "taken from the given strip" in done.err
    told = json.loads(Path("fit.json").read_text())
    assert (told["model"], told["success"], told["candidates"]) == ("d(s)", True, [])
    for name, value in {**TRUTH, "displacement_delay": 12.3}.items():
        low, high = {**told["parameters"], **told["derived"]}[name]["ci95"]
        assert low <= value <= high, name
    strip = load_strip("fitted.toml")
    assert isinstance(strip, type(ilg.PAPER))
    assert lumped_port(strip).capacitance == pytest.approx(lumped_port(ilg.PAPER).capacitance)
    assert strip.uncertainty is not None
    assert strip.uncertainty.names[0] == "coupling_gain"


def test_films_go_together_and_need_no_circuit(tmp_path: Path) -> None:
    """Of a strip whose circuit is unknown the answer is that of the whole one: d(s) asks for sizes alone."""
    drives = {"drive": "step:2V", "onset": 12.3, "engine": "exact"}
    whole = ilg.identify(STEP, "paper", **drives)
    sized = ilg.identify(STEP, **SIZES, **drives)
    assert {"circuit-not-measured", "modulus-assumed"} <= codes(sized.findings)
    for name, value in TRUTH.items():
        assert sized.parameters[name].value == pytest.approx(whole.parameters[name].value, rel=1e-9)
        assert value == pytest.approx(whole.parameters[name].value, rel=0.2)
    assert "displacement_delay" not in whole.derived
    assert whole.port is None
    whole.save(tmp_path / "report.html")
    assert "displacement under step 2 V, as stated" in (tmp_path / "report.html").read_text(encoding="utf-8")
    late = {**AFTER, "time_s": AFTER["time_s"] - 8.2}  # one statement of the onset holds for both
    both = ilg.identify(
        [STEP, late], "paper", drive=(PULSE.times, PULSE.values), until="29 s", onset=12.3, engine="exact"
    )
    assert both.sources == ("data 1", "data 2")
    assert len(both.observations) == 2
    assert both.observations[0].rms_predicted is not None
    assert "displacements alone together" in both.summary()


def test_a_film_beside_a_record_shares_its_coupling() -> None:
    t = np.arange(-5.0, 60.0, 0.25)
    after = simulate(ilg.PAPER, PiecewiseLinear.step(4.0), t[t >= 0], engine="exact", beam="static")
    record = {"time_s": t, "voltage_V": np.where(t < 0, 0.0, 4.0), "current_A": np.zeros(len(t))}
    record["current_A"][t >= 0] = after.current
    record["current_A"] += 2e-4 * np.random.default_rng(3).standard_normal(len(t))
    sets = [ilg.read(record, onset=0.0), *sets_of(STEP, 12.3, drive="step:2V")]
    found = ilg.identify(sets, "paper", model="rc", engine="exact")
    assert found.films == found.sources[1:]
    assert [o.quantity for o in found.observations] == ["current", "displacement"]
    assert found.parameters["capacitance"].value == pytest.approx(0.35, rel=0.05)
    assert found.parameters["coupling_zero"].value == pytest.approx(TRUTH["coupling_zero"], rel=0.1)


@pytest.mark.parametrize(
    "form",
    [
        *(
            "step:2V",
            "square:-1V..2V,30s",
            "triangle:2V,20s",
            "cv:-1V..1V,50mV/s",
            "pulse:2V,5s,20s,3",
            "sine:2V,0.05Hz",
        ),
        *("chirp:1V,0.01Hz..0.1Hz", "multisine:1V,0.01Hz..0.1Hz", "ramp:10mV/s", "file:drive.csv"),
    ],
)
def test_every_drive_by_name_is_what_a_run_has(form: str, run: Run) -> None:
    write("drive.csv", {"time_s": np.array([0.0, 5, 5, 100]), "voltage_V": np.array([0.0, 0, 2, 1])})
    (made,) = sets_of(STEP, drive=form)
    assert isinstance(made, Film)
    t = np.linspace(0.0, 75.0, 301)
    same = parse_drive(form, made.duration).value(made.onset + t)
    assert made.drive.value(t) == pytest.approx(same, abs=2e-4)
    assert made.onset == (5.0 if form.startswith("file") else 0.0)


@pytest.mark.parametrize(
    ("file", "options", "words"),
    [
        ("camera.csv", "", ("no column for voltage", "state what drove it: --drive step:2V")),
        (
            "volt.csv",
            "--drive step:2V",
            ("has a voltage of its own ('voltage_V'), which holds", "--drive file:volt.csv"),
        ),
        ("rest.csv", "--drive step:2V", ("no column for displacement",)),
        ("camera.csv", "--drive step:0V", ("the drive, step 0 V, stays at 0 V: nothing moves the strip",)),
        ("camera.csv", "--drive file:rest.csv", ("stays at 0 V",)),
        ("camera.csv", "--drive file:short.csv", ("ends 35 s after its onset", "--until 35s")),
        ("camera.csv", "--drive step:2V --model rc", ("--model rc: a displacement alone does not determine",)),
        ("camera.csv", "--drive step:2V --own capacitance", ("coupling_gain",)),
        ("camera.csv", "--drive step:2V --onset last-rest", ("--onset last-rest", "give a time such as 4s")),
        ("camera.csv", "--drive step:2V --onset 1s --displacement-delay 1s", ("give one of them",)),
        ("camera.csv", "--drive step:2V --displacement volt.csv", ("give one of them",)),
        ("camera.csv", "--drive other.csv=step:2V", ("'other.csv' is not one of them",)),
        ("camera.csv", "--drive stp:2V", ("drive 'stp:2V' is not understood",)),
    ],
)
def test_what_does_not_go_together_is_one_line(file: str, options: str, words: tuple[str, ...], run: Run) -> None:
    write("camera.csv", STEP)
    write("volt.csv", {**STEP, "voltage_V": np.where(STEP["time_s"] < 12.3, 0.0, 2.0)})
    write("rest.csv", {"time_s": np.array([0.0, 100.0]), "voltage_V": np.zeros(2)})
    write("short.csv", {"time_s": np.array([0.0, 5, 5, 40]), "voltage_V": np.array([0.0, 0, 2, 2])})
    assert_one_line(run("identify", file, *options.split()), *words)


def test_an_electrode_resistance_needs_the_circuit() -> None:
    how = {"drive": "step:2V", "onset": 12.3, "engine": "exact", "electrode_resistance": "3 ohm"}
    with pytest.raises(InputError, match="dc_resistivity, dynamic_resistivity and permittivity"):
        ilg.identify(STEP, **SIZES, **how)
    found = ilg.identify(STEP, "paper", **how)
    assert lumped_port(found.actuator).electrode_resistance == pytest.approx(3.0)
