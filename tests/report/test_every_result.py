"""Every result has the same doors: lines, HTML, plot, tables, files, and it pickles. A new class needs an example."""

from __future__ import annotations

import base64
import copy
import csv
import json
import pickle
import pkgutil
import re
from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
import xarray
from gels import TWO, readings
from matplotlib import pyplot
from matplotlib.figure import Figure
from synthetic import record, step

import ilg_circuit
from ilg_circuit.arms.motion import Motion
from ilg_circuit.arms.run import ArmResult
from ilg_circuit.control.close import Closed
from ilg_circuit.control.learn import Learned, learn
from ilg_circuit.control.programme import Limits
from ilg_circuit.control.track import Tracked, track
from ilg_circuit.control.tracked_shape import TrackedShape
from ilg_circuit.control.tune import Tuned, tune
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.fit.curve import fit_curve
from ilg_circuit.fit.result import FitResult
from ilg_circuit.hyperelastic import characterise
from ilg_circuit.hyperelastic.characterisation import Characterisation
from ilg_circuit.identification import Identification, identify
from ilg_circuit.identification.batch import Batch, FileFit
from ilg_circuit.identification.frequency_response import BodeOfRecords
from ilg_circuit.identification.sensing import SensingFit
from ilg_circuit.identification.shape import ShapeFit, bent_line, identify_shape
from ilg_circuit.identification.sheets import SheetsFit, identify_sheets
from ilg_circuit.measurements.film import Film, film_of
from ilg_circuit.measurements.marks import Marks
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.measurements.track import Track
from ilg_circuit.oscillators.entrainment import Entrainment
from ilg_circuit.oscillators.loop_run import ReflexRun, ReflexSweep
from ilg_circuit.oscillators.run import RhythmRun, cpg
from ilg_circuit.oscillators.sweep import RhythmSweep, cpg_sweep
from ilg_circuit.report import doors, page
from ilg_circuit.result import Result
from ilg_circuit.simulation.bode import Bode, bode
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.energy import EnergyAccount
from ilg_circuit.simulation.impedance import Impedance, impedance
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.simulation.sensing import Sensed, sense
from ilg_circuit.simulation.shape import Shape
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import load_actuator
from ilg_circuit.study import search, space
from ilg_circuit.study.design import DesignReport, design
from ilg_circuit.study.pareto import Front
from ilg_circuit.study.sweep import SweepResult, sweep

T = np.linspace(0.0, 100.0, 51)


def _design() -> DesignReport:
    with pytest.MonkeyPatch.context() as patch:
        for table, value in ((space.INITIAL_POINTS, 64), (search.STARTS, 2), (search.POLISHING, (1, 2))):
            patch.setitem(table, "exact", value)
        asked: dict[str, Any] = {"require": ["displacement_final>=3mm"], "minimise": "energy", "points": 3}
        vary = ["thickness=0.3mm:0.8mm", "voltage=2V:4V"]
        return design("paper", "step:4V", "300s", vary=vary, pareto="displacement_final,force_blocked", **asked)


def _front() -> Front:
    front = example(DesignReport).front
    assert isinstance(front, Front)
    return front


def _shape_fit() -> ShapeFit:
    at = np.array([5e-3, 15e-3, 30e-3])
    ends = bent_line(at, 0.03, 20.0, 1.0) + 1e-6 * np.array([1, -1, 1])
    x, y = (tuple(np.stack(part, axis=1)) for part in ((at, ends.real), (0 * at, ends.imag)))
    return identify_shape(Marks("marks.csv", (np.array([0.0, 300.0]),) * 3, x, y), PAPER)


def _sheets_fit() -> SheetsFit:
    f = np.geomspace(1e-3, 10, 12)
    y = (1 / 600 + 1 / (20 + 1 / (2j * np.pi * f * 0.3))) / 0.035
    z = np.sqrt(400 / y) / np.tanh(np.sqrt(400 * y) * 0.035) * (1 + 1e-3 * np.sin(37 * np.arange(12)))
    return identify_sheets([Spectrum("z.csv", f, z)], [0.035], 5e-3, model="rc")


def _curve() -> FitResult:
    x = np.linspace(0, 5, 40)
    y = 3 * np.exp(-2 * x) + 0.01 * np.sin(37 * x)
    return fit_curve(lambda x, a, b: a * np.exp(-b * x), x, y, [1, 1], names=("a", "b"))


#: One small result of each class.
EXAMPLES: dict[type[Result], Callable[[], Result]] = {
    Response: lambda: simulate(PAPER, parse_drive("step:4V", 100.0), T, engine="exact"),
    EnergyAccount: lambda: example(Response).account,
    Bode: lambda: bode(PAPER, np.geomspace(1e-3, 10, 9)),
    BodeOfRecords: lambda: ilg_circuit.bode_of({"time_s": T, "voltage_V": np.sin(T), "displacement_mm": np.cos(T)}),
    Impedance: lambda: impedance(PAPER, np.geomspace(1e-3, 10, 9), engine="exact"),
    Shape: lambda: example(Response).shape(points=5),
    Sensed: lambda: sense(PAPER, parse_drive("step:1mm", 100.0, "m"), T, engine="exact"),
    Identification: lambda: identify(
        record(step(), 300.0, 61, rest=5, noise=1e-3).measurement(), base=PAPER, model="rc", engine="exact"
    ),
    Batch: lambda: Batch(
        (FileFit("a.csv", content=example(Identification).to_dict()), FileFit("b.csv", 2, error="no"))
    ),
    ShapeFit: _shape_fit,
    SheetsFit: _sheets_fit,
    SensingFit: lambda: ilg_circuit.identify_sensing(
        {"time_s": T, "displacement_mm": np.sin(T / 3), "current_uA": np.sin(T / 3) + 1e-3 * np.cos(T**2)}, PAPER
    ),
    FitResult: _curve,
    Characterisation: lambda: characterise(readings(TWO, "uniaxial", noise=0.01), terms=1),
    RhythmRun: lambda: cpg("3s"),
    RhythmSweep: lambda: cpg_sweep("inhibition=1:3:5"),
    ReflexRun: lambda: ilg_circuit.reflex("8 s", "paper", 10, inhibition=4.5, samples=81),
    ReflexSweep: lambda: ilg_circuit.reflex(strip="paper", sweep="reflex=0:20:3", inhibition=4.5),
    Entrainment: lambda: ilg_circuit.reflex(
        strip="paper", gain=100, entrain=0.05, inhibition=4.5, frequencies=[0.7, 0.9, 1.5]
    ),
    DesignReport: _design,
    Front: _front,
    Closed: lambda: ilg_circuit.close_loop(
        PAPER, example(Tuned), "step:3mm", "50 s", period="0.5 s", samples=26, engine="exact"
    ),
    Tracked: lambda: track(PAPER, parse_drive("step:3mm", 100.0, "m"), 100.0, Limits(4.0), nodes=21),
    TrackedShape: lambda: ilg_circuit.track(
        PAPER.with_(electrodes={"sheet_resistance_1": 5, "sheet_resistance_2": 5, "segments_1": 2, "cells": 2}),
        {1: "sine:5 1/m,10mHz", "angle": "step:0 rad"},
        "100 s",
        nodes=21,
        beam="static",
    ),
    Learned: lambda: learn(PAPER, parse_drive("triangle:2mm,50s", 100.0, "m"), 100.0, nodes=41, trials=2),
    Tuned: lambda: tune(PAPER, 3e-3, gains={"gain": 2e4, "reset_time": 10.0}, beam="static"),
    SweepResult: lambda: sweep("paper", "step:4V", "300s", vary=["thickness=0.3mm:1mm:4"], engine="exact", jobs=1),
    ArmResult: lambda: ilg_circuit.arm("0.2s", formulation="chain", segments=3, samples=21),
    Motion: lambda: example(ArmResult).motion,
    Record: lambda: record(step(), 300.0, 61, rest=5, noise=1e-3).measurement(),
    Film: lambda: film_of(Track("tip.csv", T, 1e-3 * np.maximum(T - 4.0, 0.0)), PiecewiseLinear.step(2.0)),
    Spectrum: lambda: Spectrum("z.csv", np.geomspace(1e-3, 10, 9), 20 + 5 / (1 + 1j * np.geomspace(1e-2, 100, 9))),
}
#: Those that make a strip.
STRIPS = (Identification, DesignReport, SensingFit)
SUFFIXES = (".csv", ".json", ".png", ".pdf", ".svg", ".html", ".nc")

each = pytest.mark.parametrize("kind", EXAMPLES, ids=lambda kind: kind.__name__)


@cache
def example(kind: type[Result]) -> Any:
    return EXAMPLES[kind]()


@pytest.fixture(autouse=True)
def no_open_figures() -> Iterator[None]:
    pyplot.close("all")
    yield
    pyplot.close("all")


def subclasses(kind: type) -> Iterator[type]:
    for found in kind.__subclasses__():
        yield found
        yield from subclasses(found)


def test_every_class_of_results_has_an_example() -> None:
    for module in pkgutil.walk_packages(ilg_circuit.__path__, "ilg_circuit."):
        if not module.name.endswith("__main__"):
            import_module(module.name)
    shown = {kind for kind in subclasses(Result) if "presenter" in vars(kind) and kind.__module__.startswith("ilg_")}
    assert shown == set(EXAMPLES)


@each
def test_lines_are_few_and_plain(kind: type[Result]) -> None:
    lines = repr(example(kind)).splitlines()
    assert 2 <= len(lines) <= 10
    assert lines[0].startswith(kind.__name__)
    assert max(map(len, lines)) <= 118
    assert not re.search(r"array\(|dtype|object at 0x", repr(example(kind)))
    assert example(kind).summary()


@each
def test_html_is_a_table_with_a_small_picture(kind: type[Result]) -> None:
    html = example(kind)._repr_html_()
    assert len(html) < 100_000
    assert html.count("<tr>") >= 2
    (png,) = re.findall(r'src="data:image/png;base64,([^"]*)"', html)
    assert base64.b64decode(png).startswith(b"\x89PNG")
    assert not pyplot.get_fignums()


@each
def test_a_table_of_pandas_has_the_columns_of_a_csv_file(kind: type[Result], tmp_path: Path) -> None:
    result = example(kind)
    columns, frame = result.columns(), result.to_dataframe()
    assert list(frame) == list(columns)
    for header, values in columns.items():
        expected = pandas.Series(list(values), name=header)
        pandas.testing.assert_series_equal(frame[header], expected, check_dtype=False)
    result.save(tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header == list(frame)
    for name, cells in zip(header, zip(*rows, strict=True), strict=True):
        if frame[name].dtype.kind in "fi":  # to the last bit
            np.testing.assert_array_equal([float(cell or "nan") for cell in cells], frame[name])


@each
def test_a_dataset_of_xarray_has_units_and_goes_through_a_file(kind: type[Result], tmp_path: Path) -> None:
    result = example(kind)
    with result.to_xarray() as data:
        numbers = [name for name in data.variables if data[name].dtype.kind == "f"]
        told = {name: data[name].attrs.get("units") for name in numbers}
        by_row = ("value", "stderr", "low", "high") if "parameter" in data.coords else ()
        assert {name for name, unit in told.items() if unit is None} <= set(by_row)
        result.save(tmp_path / "data.nc")
        with xarray.open_dataset(tmp_path / "data.nc", engine="h5netcdf") as again:
            xarray.testing.assert_allclose(again.load(), data.load(), rtol=0, atol=0)
            assert json.loads(again.attrs["provenance"]) == result.provenance.to_dict()


@each
def test_plain_data_go_through_json(kind: type[Result], tmp_path: Path) -> None:
    result = example(kind)
    result.save(tmp_path / "result.json")
    content = json.loads((tmp_path / "result.json").read_text())
    assert content == json.loads(json.dumps(result.to_dict() | {"provenance": result.provenance.to_dict()}))


@each
def test_files_by_suffix(kind: type[Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if kind is not RhythmSweep:  # the pages' pictures are drawn, and written for one class
        monkeypatch.setattr(page, "png", lambda figure, dpi: "")
    result = example(kind)
    pictures = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"} if kind is RhythmSweep else {}
    for suffix, start in {".html": b"<!", **pictures}.items():
        result.save(tmp_path / f"file{suffix.upper()}")
        assert (tmp_path / f"file{suffix.upper()}").read_bytes().startswith(start)
    assert not pyplot.get_fignums()
    if kind in STRIPS:
        result.save(tmp_path / "strip.toml")
        assert load_actuator(tmp_path / "strip.toml").geometry.free_length > 0
    for name in ("file.xlsx", "file", *([] if kind in STRIPS else ["strip.toml"])):
        with pytest.raises(InputError, match="cannot save") as caught:
            result.save(tmp_path / name)
        assert all(suffix in str(caught.value) for suffix in SUFFIXES)
        assert "\n" not in str(caught.value)
        assert not (tmp_path / name).exists()
    with pytest.raises(InputError, match="does not exist"):
        result.save(tmp_path / "none" / "file.csv")


@each
def test_a_panel_is_drawn_on_the_axes_that_are_given_and_nowhere_else(kind: type[Result]) -> None:
    result = example(kind)
    figure = Figure()
    left, right = figure.subplots(1, 2)
    assert result.plot(left) is left
    assert left.get_children() != []
    assert left.has_data()
    assert left.get_xlabel()
    assert not right.has_data()
    assert not pyplot.get_fignums()


@each
def test_the_whole_picture_is_one_of_pyplot(kind: type[Result]) -> None:
    result = example(kind)
    axes = np.ravel(result.plot())
    assert len(pyplot.get_fignums()) == 1
    assert list(axes) == pyplot.gcf().axes
    apart = result.figure()
    assert len(pyplot.get_fignums()) == 1
    assert [a.get_ylabel() for a in apart.axes] == [a.get_ylabel() for a in axes]


@each
def test_every_panel_can_be_named(kind: type[Result]) -> None:
    result = example(kind)
    for name in doors._presenter(result).panels(result):
        assert np.ravel(result.plot(what=name))[0].has_data()
        assert len(pyplot.get_fignums()) == 1
        pyplot.close("all")
    with pytest.raises(InputError, match="unknown panel 'nonsense'"):
        result.plot(what="nonsense")
    with pytest.raises(InputError, match="ax is str; give matplotlib axes"):
        result.plot(ax="left")
    with pytest.raises(InputError, match="each once"):
        result.plot("left", "right")
    with pytest.raises(InputError, match="cannot draw with flavour"):
        result.plot(flavour=3)
    assert not pyplot.get_fignums()


@each
def test_results_pickle_and_copy(kind: type[Result]) -> None:
    result = example(kind)
    for again in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert type(again) is kind
        assert repr(again) == repr(result)
        assert again.summary() == result.summary()
        assert json.dumps(again.to_dict()) == json.dumps(result.to_dict())
        again.plot(Figure().subplots())
