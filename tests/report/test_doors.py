"""The numbers behind the doors of results: what is drawn, named, written, and refused."""

from __future__ import annotations

import copy
import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure
from synthetic import record, step

from ilg_circuit import extras
from ilg_circuit.errors import InputError, MissingLibraryError, SolveError
from ilg_circuit.fit.curve import fit_curve
from ilg_circuit.fit.estimate import Estimate
from ilg_circuit.identification import Identification, identify
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.impedance import impedance
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study.design import design
from ilg_circuit.study.sweep import sweep

T = np.linspace(0.0, 100.0, 51)
X = np.linspace(0.0, 5.0, 40)


def response(drive: str = "step:4V") -> Response:
    return simulate(PAPER, parse_drive(drive, 100.0), T, engine="exact")


@pytest.fixture(scope="module")
def spectrum_fit() -> Identification:
    frequency = np.geomspace(1e-3, 1e3, 25)
    z = impedance(replace(PAPER, coupling=None), frequency, engine="exact").impedance
    noisy = z * (1 + 1e-3 * np.random.default_rng(2).standard_normal(25))
    return identify(Spectrum("z.csv", frequency, noisy), base=PAPER, model="rc", engine="exact")


@pytest.fixture(scope="module")
def joint_fit() -> Identification:
    records = [record(step(u), 300.0, 61, rest=5, noise=1e-3, seed=k) for k, u in enumerate((2.0, 4.0))]
    data = [replace(r.measurement(), source=f"{k}.csv") for k, r in enumerate(records)]
    return identify(data, base=PAPER, model="rc", engine="exact")


def test_a_panel_shows_the_numbers_in_a_readable_unit() -> None:
    found = response()
    axes = found.plot(Figure().subplots(), what="current", color="red", label="4 V")
    (line,) = axes.get_lines()
    assert line.get_ydata() == pytest.approx(1e3 * found.current)
    assert line.get_xdata() == pytest.approx(T)
    assert (axes.get_ylabel(), line.get_color(), line.get_label()) == ("current [mA]", "red", "4 V")


def test_what_is_drawn_together_has_one_unit() -> None:
    axes = Figure().subplots()
    strong, weak = response(), response("step:1mV")
    for found in (strong, weak):
        found.plot(axes)
    for line, found in zip(axes.get_lines(), (strong, weak), strict=True):
        assert line.get_ydata() == pytest.approx(1e3 * found.displacement)
    assert axes.get_ylabel() == "displacement [mm]"
    axes.clear()
    for panel in (axes, Figure().subplots()):
        assert weak.plot(panel).get_ylabel() == "displacement [\N{MICRO SIGN}m]"


def test_a_bode_plot_on_one_pair_of_axes_or_two() -> None:
    found = impedance(PAPER, np.geomspace(1e-3, 10, 9), engine="exact")
    upper, lower = found.plot(Figure().subplots(2, 1), what="bode")
    assert upper.get_lines()[0].get_ydata() == pytest.approx(np.abs(found.impedance))
    assert lower.get_lines()[0].get_ydata() == pytest.approx(np.degrees(np.angle(found.impedance)))
    figure = Figure()
    left, right = found.plot(figure.subplots(), what="bode")
    assert figure.axes == [left, right]
    assert right.get_lines()[0].get_ydata() == pytest.approx(np.degrees(np.angle(found.impedance)))
    nyquist = found.plot(Figure().subplots()).get_lines()[0]
    assert nyquist.get_ydata() == pytest.approx(-found.impedance.imag)


def test_a_picture_that_fails_leaves_no_figure_open(monkeypatch: pytest.MonkeyPatch) -> None:
    pyplot.close("all")
    vary, outputs = ["thickness=0.3mm:1mm:2"], ("force_final",)
    same = sweep("paper", "step:4V", "300s", vary=vary, outputs=outputs, engine="exact", jobs=1)
    assert len(same.figure().axes) == 1  # a free tip has no force, whatever the design: that is drawn
    monkeypatch.setattr("ilg_circuit.report.sweep._interesting", lambda _: ())
    with pytest.raises(InputError, match="nothing to draw"):
        same.plot()
    with pytest.raises(InputError, match="nothing to draw"):
        same.plot(Figure().subplots())
    monkeypatch.setattr("ilg_circuit.report.response._drive", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        response().plot()
    assert not pyplot.get_fignums()
    assert "<img" not in same._repr_html_()


def test_parameters_by_name(step_fit: Identification, spectrum_fit: Identification) -> None:
    for fit in (step_fit, spectrum_fit):
        found, whole = fit["capacitance"], fit.parameters["capacitance"]
        error, interval = whole.reported
        assert (found.value, found.stderr, found.interval, found.unit) == (whole.value, error, interval, "F")
        assert interval[0] < found.value < interval[1]
        assert fit["time_constant"].unit == "s"  # what follows from them too
        frame = fit.to_dataframe().set_index("parameter").loc["capacitance"]
        assert (frame["value"], frame["stderr"], frame["low"], frame["high"]) == (found.value, error, *interval)
    assert spectrum_fit["electrode_resistance"].interval is None
    with pytest.raises(InputError, match="unknown parameter 'capacitence'; perhaps capacitance"):
        step_fit["capacitence"]


def test_an_estimate_quotes_the_error_that_allows_for_autocorrelation() -> None:
    plain = Estimate(2.0, "F", 0.1, (1.8, 2.2))
    wider = replace(plain, autoregression=0.3, ci95_autoregression=(1.412345, 2.612345), method="autoregression")
    assert (plain.quoted.stderr, plain.interval) == (0.1, (1.8, 2.2))
    assert (wider.quoted.stderr, wider.interval) == (0.3, (1.412345, 2.612345))
    assert repr(wider) == "<Estimate 2 F, standard error 300 mF, 95 % interval 1.4123 F to 2.6123 F>"
    assert repr(Estimate(2.0, "F", fixed_because="held at 2 F")) == "<Estimate 2 F, held at 2 F>"
    assert repr(Estimate(2.0, "F")) == "<Estimate 2 F, error not known>"
    bare = Estimate(2.0, "F", 0.1)  # such as a drift's, which has no interval
    assert repr(bare) == "<Estimate 2 F, standard error 100 mF>"
    assert bare.quoted == bare


def test_a_fitted_curve_by_name() -> None:
    fit = fit_curve(lambda x, a, b: a * np.exp(-b * x), X, 3 * np.exp(-2 * X) + 0.01 * np.sin(37 * X), [1, 1])
    assert (fit["b1"].value, fit["b1"].stderr) == (fit.values[0], fit.errors[0])
    assert fit["b1"].interval == tuple(fit.intervals[0])
    assert list(fit) == ["b1", "b2"]
    assert "b1" in fit
    assert "a" not in fit
    with pytest.raises(InputError, match="unknown parameter 'a'; known are b1, b2"):
        fit["a"]
    data = fit.to_xarray()
    assert data["data_1"].values - data["data_fit_1"].values == pytest.approx(fit.residuals_of(0))


def test_a_complex_curve_has_both_parts() -> None:
    z = 1 / (1 + 2j * X) + 1e-3 * np.exp(30j * X)
    fit = fit_curve(lambda x, tau: 1 / (1 + 1j * tau * x), X, z, [1.0], names=("tau",))
    data = fit.to_xarray()
    assert data["re_data_1"].values + 1j * data["im_data_1"].values == pytest.approx(z)
    assert [line.get_label() for line in fit.plot(Figure().subplots()).get_lines()] == [
        "data, real", "fit, real", "data, imag", "fit, imag",
    ]  # fmt: skip


def test_a_spectrum_is_a_nyquist_plot(spectrum_fit: Identification) -> None:
    axes = spectrum_fit.plot(Figure().subplots())
    (o,) = spectrum_fit.observations
    assert axes.get_xlabel().startswith("Re Z")
    points = axes.get_lines()[0].get_xydata()
    assert points[:, 0] == pytest.approx(o.data.real)
    assert points[:, 1] == pytest.approx(-o.data.imag)
    data = spectrum_fit.to_xarray()
    assert data["re_impedance_1"].values == pytest.approx(o.data.real)
    assert data["im_impedance_fit_1"].attrs["units"] == "ohm"


def test_several_files_are_drawn_together(joint_fit: Identification) -> None:
    axes = joint_fit.plot(Figure().subplots())
    lines = axes.get_lines()
    assert len(lines) == 4
    for pair, o in zip((lines[:2], lines[2:]), joint_fit.observations, strict=True):
        shown = o.abscissa > 0 if axes.get_xscale() == "log" else slice(None)
        assert pair[0].get_ydata() == pytest.approx(1e3 * o.data[shown])
        assert pair[1].get_ydata() == pytest.approx(1e3 * o.fitted[shown])
    assert [t.get_text() for t in axes.get_legend().get_texts()] == list(joint_fit.sources)
    assert joint_fit.plot(Figure().subplots(), what="comparison").has_data()


def test_fits_of_every_kind_pickle(spectrum_fit: Identification, joint_fit: Identification) -> None:
    for fit in (spectrum_fit, joint_fit):
        again = pickle.loads(pickle.dumps(fit))
        assert again.to_dict() == fit.to_dict()
        assert again.figure().axes
        with pytest.raises(SolveError, match="fit again"):
            again.fit.problem.predicted(again.fit.values[None])
        here = copy.deepcopy(fit)  # which predicts on
        assert here.fit.problem.predicted(fit.fit.values[None]).shape == fit.fit.residuals[None].shape


def test_files_of_python_have_every_column_those_of_the_command_have_not(tmp_path: Path) -> None:
    found = response()
    found.save(tmp_path / "all.csv")
    found.write_csv(tmp_path / "command.csv")
    heads = [(tmp_path / f"{name}.csv").read_text().splitlines()[0] for name in ("command", "all")]
    assert heads[1] == f"{heads[0]},energy_J"


def test_a_missing_library_is_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = response()
    real = extras.find_spec
    absent = {"pandas", "xarray", "h5netcdf"}
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name in absent else real(name))
    for call, extra in (
        (found.to_dataframe, "dataframe"),
        (found.to_xarray, "dataframe"),
        (lambda: found.save(tmp_path / "run.nc"), "study"),
    ):
        with pytest.raises(MissingLibraryError, match=rf"needs .*: install with pip install 'ilg-circuit\[{extra}\]'$"):
            call()
    found.save(tmp_path / "run.csv")  # needs neither


def test_text_in_html_is_escaped() -> None:
    strip = replace(PAPER, name="<script>alert('x')</script>\n\n& more")
    found = impedance(strip, np.geomspace(1e-3, 10, 9), engine="exact")
    for html in (found._repr_html_(), strip._repr_html_()):
        assert "<script" not in html
        assert "&lt;script&gt;" in html
        assert "&amp; more" in html
    assert len(repr(found).splitlines()) <= 10


def test_a_sweep_is_told_of_without_its_file(tmp_path: Path) -> None:
    path = tmp_path / "sweep.nc"
    vary, waveforms = ["thickness=0.3mm:1mm:3", "orientation=weightless,horizontal"], ("displacement",)
    found = sweep("paper", "step:4V", "300s", vary=vary, waveforms=waveforms, engine="exact", jobs=1, out=path)
    frame = found.to_dataframe()
    assert len(frame) == 6
    assert list(frame)[:3] == ["thickness_m", "orientation", "displacement_final_m"]
    assert not {"time_s", "displacement_m"} & set(frame)  # waveforms are in the dataset
    with found.to_xarray() as data:
        assert set(data["displacement"].dims) == {"thickness", "orientation", "time"}
        row = frame[(frame["orientation"] == "weightless")]
        solved = data["displacement_final"].sel(orientation="weightless")
        assert row["displacement_final_m"].to_numpy() == pytest.approx(solved.values, nan_ok=True)
    found.save(tmp_path / "again.nc")
    path.unlink()
    assert " of 6 designs solved" in repr(found)
    assert "<img" not in found._repr_html_()
    with pytest.raises(InputError, match="there is no such file"):
        found.to_dataframe()


@pytest.mark.usefixtures("brisk")
def test_a_design_that_misses_its_requirement_makes_no_strip(tmp_path: Path) -> None:
    missed = design("paper", "step:4V", "300s", vary=["thickness=0.8mm:1mm"], require=["displacement_final>=9mm"])
    with pytest.raises(InputError, match="no design meets all requirements, so there is no strip to write"):
        missed.save(tmp_path / "strip.toml")
    assert not list(tmp_path.iterdir())
    assert "NO design meets all requirements" in repr(missed)
    missed.save(tmp_path / "report.json")
    assert json.loads((tmp_path / "report.json").read_text())["design"]["feasible"] is False
