"""A measured law of sensing: its circuit against formulas by both engines, its file, its fit, its errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line

import ilg_circuit as ilg
from ilg_circuit.arrays import Array
from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import Actuator, Sensing
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import dumps, loads

LAW = Sensing(instantaneous=3.0, gain_1=-2.0, time_1=4.0)
STRIP = replace(ilg.PAPER, sensing=LAW)
T = np.arange(0.0, 60.0, 0.5)
ENDS = ("open", "short")


@pytest.mark.parametrize("terminals", ["open", "short"])
def test_it_is_a_source_in_series_with_the_ions(terminals: str) -> None:
    strip = replace(STRIP.with_(electrode_resistivity_1="1 ohm m", electrode_thickness_1="1 um"), sensing=LAW)
    end = 400.0
    t = np.linspace(end - 10, end, 21)
    how = {"times": t, "terminals": terminals}
    exact, other = (ilg.sense(strip, "sine:1mm,0.1Hz", engine=e, **how) for e in ("exact", "ngspice"))  # type: ignore[arg-type]
    name = "voltage" if terminals == "open" else "current"
    found = getattr(exact, name)
    assert getattr(other, name) == pytest.approx(found, abs=1e-6 * np.abs(found).max())
    s = 0.2j * np.pi
    port, g = lumped_elements(strip).port, strip.geometry
    e = (3.0 - 2.0 / (1 + 4.0 * s)) * g.thickness / g.free_length**2 * 1e-3
    ion, dc, lead = port.ion_impedance(np.array([s]))[0], port.dc_resistance, port.electrode_resistance
    open_voltage = e * dc / (dc + ion)
    phasor = open_voltage if terminals == "open" else -open_voltage / (lead + dc * ion / (dc + ion))
    # what the signal itself moves the strip by is a thousandth of it
    assert found == pytest.approx(np.imag(phasor * np.exp(s * t)), abs=3e-3 * abs(phasor))
    assert exact.force == pytest.approx(-lumped_elements(strip).stiffness * exact.displacement, rel=3e-3, abs=1e-11)


def test_a_strip_without_coupling_senses_by_its_own_law_exactly() -> None:
    found = ilg.sense(replace(STRIP, coupling=None), "ramp:0.1mm/s", times=T, engine="exact")
    g = STRIP.geometry
    strain = g.thickness / g.free_length**2 * 1e-4
    ((r, c),), dc = lumped_elements(STRIP).port.branches, lumped_elements(STRIP).port.dc_resistance
    # S(s) = (1 + 12 s)/(1 + 4 s) of a ramp, behind dc C s/(1 + (dc + r) C s)
    both = 4.0, (dc + r) * c
    terms = [(1 - 12 / a) / (1 - b / a) * np.exp(-T / a) for a, b in (both, both[::-1])]
    expected = strain * dc * c * (1 - terms[0] - terms[1])
    assert found.voltage == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_files_keep_it_and_libraries_refuse_it() -> None:
    assert loads(dumps(STRIP)) == STRIP
    assert STRIP.with_(thickness="0.4 mm").sensing == LAW
    assert ilg.simulate(STRIP, "step:1V", "10 s", engine="exact").displacement[-1] > 0
    with pytest.raises(InputError, match=r"has a \[sensing\] of its own, and a subcircuit's tip is reciprocal"):
        ilg.library(STRIP)
    for wrong, says in (({}, "has no gain"), ({"gain_1": 1.0}, "sensing.gain_1 is given and sensing.time_1 is not")):
        with pytest.raises(InputError, match=says):
            Sensing(**wrong)


def moved(strip: Actuator, terminals: str, seed: int = 0, noise: float = 2e-3) -> dict[str, Array]:
    """A record of a tip that is moved by a decaying sine, and held then."""
    y = 1e-3 * np.sin(0.6 * T) * np.exp(-T / 30) * (T < 40)
    found = ilg.sense(strip, (T, y), times=T, terminals=terminals, engine="exact")
    signal = found.voltage if terminals == "open" else found.current
    signal = signal + noise * np.ptp(signal) * np.random.default_rng(seed).normal(size=len(T)) + 0.1 * np.ptp(signal)
    return {"time_s": T, "displacement_m": y, "voltage_V" if terminals == "open" else "current_A": signal}


def test_the_fit_gives_the_law_back() -> None:
    fit = ilg.identify_sensing([moved(STRIP, "open"), moved(STRIP, "short", 1)], "paper")
    assert fit.actuator.sensing is not None
    assert list(fit.parameters) == ["sensing_instantaneous", "sensing_gain_1", "sensing_time_1"]
    for name, true in (("sensing_instantaneous", 3.0), ("sensing_gain_1", -2.0), ("sensing_time_1", 4.0)):
        e = fit[name]
        assert e.stderr is not None
        assert abs(e.value - true) < 4 * e.stderr < 0.2 * abs(true)
    # the same motion by reciprocity
    pairs = [[list(moved(strip, ends, noise=0.0).values())[2] for strip in (STRIP, ilg.PAPER)] for ends in ENDS]
    sizes = [[np.linalg.norm(x - x[0]) for x in pair] for pair in pairs]
    expected = np.sqrt(sizes[0][0] / sizes[0][1] * sizes[1][0] / sizes[1][1])
    assert fit.ratio == pytest.approx(expected, rel=0.01)
    assert fit.ratio is not None
    assert fit.ratio > 1e6
    assert not fit.warnings


def test_the_command(run: Run, tmp_path: Path) -> None:
    file, out = tmp_path / "moved.csv", tmp_path / "sensor.toml"
    rows = moved(STRIP, "open")
    np.savetxt(file, np.column_stack(list(rows.values())), delimiter=",", header=",".join(rows), comments="")
    replace(ilg.PAPER, coupling=None).save("bare.toml")
    done = run("identify", str(file), "--sensing", "--actuator", "bare.toml", "--out", str(out))
    assert done.code == 0, done.err
    assert "measured over reciprocal: unknown: the strip has no [coupling]" in done.out
    assert ilg.load(out).sensing is not None
    assert_one_line(run("identify", str(file), "--terminals", "open"), "--terminals goes with --sensing")
    assert_one_line(run("identify", str(file), "--sensing"), "--sensing needs the strip: --actuator")
    assert_one_line(run("identify", str(file), "--sensing", "--sheets"), "give one of them")


@pytest.mark.parametrize(
    ("record", "says"),
    [
        ({"time_s": T, "voltage_V": np.sin(T)}, "a sense record without motion: no column of the displacement"),
        ({"time_s": T, "displacement_mm": 0 * T, "voltage_V": np.sin(T)}, "its displacement does not move"),
        ({"time_s": T, "displacement_mm": T}, "has no voltage or current that changes"),
        ({"time_s": T, "displacement_mm": T, "voltage_V": T, "current_A": T}, "both a voltage and a current; a sense"),
        ({"time_s": T[:9], "displacement_mm": T[:9], "voltage_V": T[:9]}, "9 readings; sensing needs 32"),
    ],
)
def test_what_is_wrong_is_one_line(record: dict[str, Array], says: str) -> None:
    with pytest.raises(InputError, match=says):
        ilg.identify_sensing(record, "paper")


def test_a_signal_that_the_motion_does_not_explain_is_refused() -> None:
    record = moved(STRIP, "open") | {"voltage_V": np.random.default_rng(0).normal(size=len(T))}
    with pytest.raises(InputError, match=r"the motion explains .*% of the measured voltage: look at its wires"):
        ilg.identify_sensing(record, STRIP)


def test_a_large_misfit_is_no_success(run: Run, tmp_path: Path) -> None:
    """A signal that drifts by twice its span: 40 % of the span were left, exit 0 and a strip written."""
    record = moved(STRIP, "open")
    drifting = record | {"voltage_V": record["voltage_V"] + 2 * np.ptp(record["voltage_V"]) * (T / T[-1]) ** 2}
    assert ilg.identify_sensing(record, STRIP).success
    found = ilg.identify_sensing(drifting, STRIP)
    assert not found.success
    assert found.to_dict()["success"] is False
    rows = np.column_stack(list(drifting.values()))
    np.savetxt(tmp_path / "moved.csv", rows, delimiter=",", header=",".join(drifting), comments="")
    replace(STRIP, sensing=None).save(tmp_path / "strip.toml")
    made = tmp_path / "sensor.toml"
    ended = run(
        *("identify", str(tmp_path / "moved.csv"), "--sensing", "--actuator", str(tmp_path / "strip.toml")),
        *("--out", str(made)),
    )
    assert ended.code == 1
    assert not made.exists()
