"""The front door: what users give is understood, and what they get is what the rooms make of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import ilg_circuit as ilg
from ilg_circuit.circuit.load import Load
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.file import save_actuator

T = np.arange(-5.0, 60.0, 0.25)
U = np.where(T < 0, 0.0, 4.0)
CURRENT = np.where(T < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-np.maximum(T, 0) / 7)) + 1e-4 * np.random.default_rng(
    1
).normal(size=len(T))
RECORD = {"time_s": T, "voltage_V": U, "current_mA": 1e3 * CURRENT}
F = np.geomspace(1e-2, 1e2, 30)
Z = 2 + 1 / (1 / 600 + 1 / (20 + 1 / (2j * np.pi * F * 0.35)))


def test_every_name_is_there_and_has_help() -> None:
    for name in ilg.__all__:
        assert getattr(ilg, name) is not None
        assert name in dir(ilg)
    with pytest.raises(AttributeError, match="has no attribute 'simulat'"):
        ilg.simulat  # noqa: B018
    with pytest.raises(AttributeError, match=r"it is ilg_circuit\.results\.Response"):
        ilg.Response  # noqa: B018


def test_the_import_loads_nothing() -> None:
    code = (
        "import sys; import ilg_circuit; print([m for m in ('numpy', 'scipy', 'click', 'typing') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-S", "-c", code], capture_output=True, text=True, cwd=Path(ilg.__file__).parents[1]
    )
    assert done.stdout.strip() == "[]", done.stderr


def test_names_stay_functions_whatever_is_imported() -> None:
    import ilg_circuit.arms
    import ilg_circuit.identification
    import ilg_circuit.oscillators  # noqa: F401

    assert all(callable(f) for f in (ilg.identify, ilg.cpg, ilg.arm))


@pytest.mark.parametrize("strip", ["paper", ilg.PAPER, "file", "path"])
def test_a_strip_is_an_object_a_path_or_a_name(strip: Any, tmp_path: Path) -> None:
    if strip in ("file", "path"):
        save_actuator(ilg.PAPER, tmp_path / "strip.toml")
        strip = tmp_path / "strip.toml" if strip == "path" else str(tmp_path / "strip.toml")
    assert ilg.load(strip).geometry == ilg.PAPER.geometry


@pytest.mark.parametrize(
    ("drive", "duration"),
    [
        ("step:4V", "60 s"),
        ("step:4V", 60.0),
        (PiecewiseLinear.step(4.0), "1 min"),
        (([0.0, 60.0], [4.0, 4.0]), None),
        ((np.array([0, 60]), np.array([4, 4])), 60),
    ],
)
def test_a_run_is_the_one_of_the_rooms(drive: Any, duration: Any) -> None:
    found = ilg.simulate("paper", drive, duration, engine="exact", samples=61)
    wanted = simulate(ilg.PAPER, PiecewiseLinear.step(4.0), np.linspace(0, 60, 61), engine="exact")
    assert_allclose(found.displacement, wanted.displacement, rtol=1e-12)
    assert_allclose(found.current, wanted.current, rtol=1e-12)


@pytest.mark.parametrize("load", ["mass=1g", {"mass": "1 g"}, {"mass": 1e-3}, Load(1e-3)])
def test_a_load_is_text_parts_or_an_object(load: Any) -> None:
    found = ilg.simulate("paper", "step:1V", "5 s", engine="exact", samples=6, load=load)
    assert "Vload" in str(found.netlist.elements) or found.force[-1] != 0


def test_times_step_and_samples_are_the_same_run() -> None:
    runs = [
        ilg.simulate("paper", "sine:1V,0.1Hz", "20 s", engine="exact", step="0.5 s"),
        ilg.simulate("paper", "sine:1V,0.1Hz", 20, engine="exact", samples=41),
        ilg.simulate("paper", "sine:1V,0.1Hz", engine="exact", times=np.linspace(0, 20, 41)),
    ]
    for run in runs[1:]:
        assert_allclose(run.displacement, runs[0].displacement, rtol=1e-9, atol=1e-15)


def test_data_are_paths_columns_frames_and_arrays(tmp_path: Path) -> None:
    np.savetxt(
        tmp_path / "step.csv", np.column_stack([*RECORD.values()]), delimiter=",", header=",".join(RECORD), comments=""
    )
    from_file = ilg.read(tmp_path / "step.csv")
    arrays = ilg.read(time=T, voltage=U, current=CURRENT)
    columns = ilg.read(RECORD)
    for found in (from_file, arrays, columns):
        assert isinstance(found, Record)
        assert_allclose(found.current.values, from_file.current.values, rtol=1e-12)
        assert_allclose(found.current.time, from_file.current.time, rtol=1e-12)
        assert found.step == 4.0


def test_a_frame_is_read_like_a_file(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({**RECORD, "comment": ["x"] * len(T)})
    found = ilg.read(frame)
    assert isinstance(found, Record)
    assert [note.code for note in found.notes] == ["columns-ignored"]
    frame.to_csv(tmp_path / "step.csv", index=False)
    assert_allclose(found.current.values, ilg.read(tmp_path / "step.csv").current.values, rtol=1e-12)


@pytest.mark.parametrize("clock", ["durations", "dates"])
@pytest.mark.parametrize("title", ["time", "time_s", "time_ms"])
@pytest.mark.parametrize("index", [False, True])
def test_durations_and_dates_have_a_unit_of_their_own(clock: str, title: str, index: bool) -> None:
    pandas = pytest.importorskip("pandas")
    times = pandas.to_timedelta(T, unit="s")
    if clock == "dates":
        times += pandas.Timestamp("2026-03-01 12:00")
    frame = pandas.DataFrame({title: times, **{key: values for key, values in RECORD.items() if key != "time_s"}})
    found, same = ilg.read(frame.set_index(title) if index else frame), ilg.read(RECORD)
    assert isinstance(found, Record)
    assert isinstance(same, Record)
    assert_allclose(found.current.time, same.current.time, rtol=1e-9, atol=1e-9)
    assert found.notes == ()


@pytest.mark.parametrize("kind", ["timedelta64[s]", "datetime64[s]"])
def test_durations_and_dates_are_no_currents(kind: str) -> None:
    columns = RECORD | {"current_mA": np.arange(len(T)).astype(kind)}
    with pytest.raises(ilg.InputError, match="dates or durations"):
        ilg.read(columns)


def test_spectra_by_part_or_as_complex_numbers() -> None:
    found = [
        ilg.read(frequency=F, impedance=Z),
        ilg.read({"frequency_Hz": F, "re_ohm": Z.real, "im_ohm": Z.imag}),
        ilg.read({"freq/kHz": F / 1e3, "Re(Z)/Ohm": Z.real, "-Im(Z)/Ohm": -Z.imag}),
    ]
    for each in found:
        assert isinstance(each, Spectrum)
        assert_allclose(each.impedance, Z, rtol=1e-12)


def test_fits_from_arrays_columns_and_records_agree() -> None:
    how: dict[str, Any] = {"model": "rc", "engine": "exact"}
    fits = [
        ilg.identify(time=T, voltage=U, current=CURRENT, **how),
        ilg.identify(RECORD, **how),
        ilg.identify([ilg.read(RECORD)], **how),
    ]
    for fit in fits:
        assert fit.parameters["dynamic_resistance"].value == pytest.approx(20.0, rel=0.05)
        assert fit.parameters["dynamic_resistance"].value == pytest.approx(
            fits[0].parameters["dynamic_resistance"].value, rel=1e-12
        )
    stated = ilg.identify(RECORD, onset="-0.25 s", **how).parameters["dynamic_resistance"]
    assert stated.stderr is not None
    assert fits[0].parameters["dynamic_resistance"].stderr > stated.stderr  # type: ignore[operator]


def test_several_sets_of_data_are_fitted_together() -> None:
    fit = ilg.identify([RECORD, {"frequency_Hz": F, "re_ohm": Z.real, "im_ohm": Z.imag}], model="rc", engine="exact")
    assert [row.quantity for row in fit.observations] == ["current", "impedance"]
    assert {row.source for row in fit.observations} == {"data 1", "data 2"}


def test_ranges_are_pairs_texts_or_numbers() -> None:
    how: dict[str, Any] = {"engine": "exact", "jobs": 1, "outputs": ["displacement_final"]}
    varied: list[Any] = [
        {"thickness": ("0.4 mm", "0.6 mm", 3)},
        {"thickness": (4e-4, 6e-4, 3)},
        ["thickness=0.4mm:0.6mm:3"],
        "thickness=0.4mm:0.6mm:3",
    ]
    found = [ilg.sweep("paper", "step:4V", "300 s", vary, **how).to_xarray().displacement_final for vary in varied]
    for each in found[1:]:
        assert_allclose(each, found[0], rtol=1e-12)
    # EC (37): as 1/b^2, at the end of a run
    assert_allclose(found[0] * np.array([0.4, 0.5, 0.6]) ** 2, found[0][1] * 0.25, rtol=1e-6)


STEP: dict[str, Any] = {"strip": "paper", "drive": "step:4V", "duration": "10 s"}
BAD: list[tuple[str, dict[str, Any], str]] = [
    ("simulate", STEP | {"strip": 3}, "a strip is an object, the path of a TOML file or a preset's name, not int"),
    ("simulate", STEP | {"strip": "papre"}, "no actuator 'papre'"),
    ("simulate", STEP | {"drive": "stop:4V"}, "drive 'stop:4V' is not understood"),
    ("simulate", STEP | {"drive": 4.0}, "a drive is a text"),
    ("simulate", STEP | {"drive": ([0, 1], [0, 1, 2])}, "times"),
    ("simulate", STEP | {"drive": (["a", "b"], [0, 1])}, "drive"),
    ("simulate", STEP | {"duration": "10 V"}, "duration: unit 'V' does not measure this quantity; use 's'"),
    ("simulate", STEP | {"duration": None}, "duration is missing"),
    ("simulate", STEP | {"duration": [1, 2]}, "duration is list [1, 2]; give a number in s or a text such as '30 s'"),
    ("simulate", STEP | {"times": [0, 1]}, "give either times, or a duration"),
    ("simulate", STEP | {"tip": "loose"}, "tip is 'loose'; choose free or clamped"),
    ("simulate", STEP | {"load": {"weight": 1}}, "load '{'weight': 1}' is not understood; write mass=1g"),
    ("simulate", STEP | {"load": 3}, "load '3' is not understood"),
    ("simulate", STEP | {"engine": "spice"}, "engine"),
    ("impedance", {"strip": "paper", "low": "1 V"}, "low: unit 'V'"),
    ("impedance", {"strip": "paper", "frequency": ["a"]}, "frequenc"),
    ("sense", {"strip": "paper", "motion": "sine:1V,1Hz", "duration": 1}, "unit 'V' does not measure"),
    ("read", {}, "give paths, a data frame or columns"),
    ("read", {"time": T, "volts": U}, "'volts' is not a known array"),
    ("read", {"time": T, "voltage": U}, "no column for current"),
    ("read", {"time": T, "voltage": U, "current": CURRENT[:-1]}, "different lengths"),
    ("read", {"time": T, "voltage": U, "current": ["x"] * len(T)}, "holds something else than numbers"),
    ("identify", {}, "give data, or arrays by keyword"),
    ("identify", {"data": []}, "no data were given"),
    ("identify", {"data": 7}, "data are a path, a data frame or columns by header"),
    ("identify", {"data": "nowhere.csv"}, "nowhere.csv"),
    ("identify", {"data": {"time_s": T, "voltage": U, "current_mA": CURRENT}}, "voltage"),
    ("identify", {"data": RECORD, "model": "rc9"}, "model is 'rc9'; choose one of"),
    ("identify", {"data": RECORD, "onset": "soon"}, "onset"),
    ("identify", {"data": RECORD, "electrode_resistance": "2 V"}, "Re: unit 'V'"),
    ("ogden", {}, "no test was given"),
    ("sweep", STEP | {"vary": {"thicknes": (1, 2)}}, "unknown parameter 'thicknes'; perhaps"),
    ("design", STEP | {"vary": {"thickness": ("1 mm", "2 V")}, "minimise": "energy"}, "unit 'V'"),
    ("cpg", {"duration": "1 V"}, "unit 'V'"),
    ("arm", {"duration": "20 ms", "activation": "jump"}, "activation is 'jump'"),
    ("library", {"strip": "paper", "name": "1strip"}, "subcircuit name"),
]


@pytest.mark.parametrize(("function", "given", "hint"), BAD, ids=[f"{f}-{h[:20]}" for f, _, h in BAD])
def test_bad_input_is_one_line(function: str, given: dict[str, Any], hint: str) -> None:
    with pytest.raises(ilg.InputError) as raised:
        getattr(ilg, function)(**given)
    assert isinstance(raised.value, ValueError)
    assert hint in str(raised.value)
    assert "\n" not in str(raised.value)
