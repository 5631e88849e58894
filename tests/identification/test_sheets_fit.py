"""The resistance along a strip from spectra: the line against cells of it, round trips, errors, coverage, verdicts."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from scipy.stats import binom

import ilg_circuit as ilg
from ilg_circuit.errors import InputError
from ilg_circuit.files import write_csv
from ilg_circuit.findings import codes
from ilg_circuit.fit.limits import least_squares
from ilg_circuit.identification.impedance import ImpedanceData
from ilg_circuit.identification.sheets_model import Contact, Line, SheetsModel, _result
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.strip.models import electrical_model

LENGTH, WIDTH = 0.035, 5e-3
F = np.geomspace(1e-4, 100, 60)
#: Rdc, Rd, C of the paper's strip
PORT = (666.667, 19.43635, 0.35)
RC = SheetsModel(electrical_model("rc"), 0.0)


def admittance(f: np.ndarray) -> np.ndarray:
    """Return the admittance of a length of the paper's strip [S/m]."""
    s = 2j * np.pi * f
    return np.asarray((1 / PORT[0] + PORT[2] * s / (1 + PORT[1] * PORT[2] * s)) / LENGTH)


def spectrum(sheets: float, length: float = LENGTH, noise: float = 0.0, seed: int = 0, f: np.ndarray = F) -> Spectrum:
    """Return the spectrum of a line with ``sheets`` [ohm per square] a side, with noise relative to abs(Z)."""
    r, y = 2 * sheets / WIDTH, admittance(f)
    z = np.sqrt(r / y) / np.tanh(np.sqrt(r * y) * length)
    random = np.random.default_rng(seed).normal(size=(2, len(f)))
    return Spectrum(f"{1e3 * length:g} mm", f, z + noise * np.abs(z) * (random[0] + 1j * random[1]))


def lines(*lengths: float) -> tuple[Line, ...]:
    return tuple(Line(length, WIDTH, LENGTH) for length in lengths)


def ladder(port: complex, sheets: float, length: float, ends: tuple[bool, bool], covered: float = 0.0) -> complex:
    """Return the impedance of 400 cells, from the nodes' equations; ``ends`` are the driven ones."""
    cells = 400
    shunt = length / LENGTH / port / cells
    along = cells / (2 * sheets / WIDTH * length)
    matrix = np.zeros((cells, cells), dtype=complex)
    right = np.zeros(cells, dtype=complex)
    np.fill_diagonal(matrix, shunt)
    for k in range(cells - 1):
        matrix[k : k + 2, k : k + 2] += along * np.array([[1, -1], [-1, 1]])
    for at, driven in zip((0, -1), ends, strict=True):
        if driven:
            matrix[at, at] += 2 * along
            right[at] = 2 * along
    current = shunt * np.linalg.solve(matrix, right).sum() + sum(ends) * covered / LENGTH / port
    return complex(1 / current)


@pytest.mark.parametrize("sheets", [1e-7, 0.244, 5.0, 200.0])
@pytest.mark.parametrize(("contact", "ends"), [("end", (True, False)), ("both", (True, True))])
def test_the_line_is_that_of_its_cells(sheets: float, contact: Contact, ends: tuple[bool, bool]) -> None:
    port = complex(1 / admittance(np.array([0.01]))[0] / LENGTH)
    for length, covered in ((0.02, 0.0), (LENGTH, 5e-3)):
        line = Line(length, WIDTH, LENGTH, contact, covered)
        found = line.impedance(np.array([[port]]), np.array([[2 * sheets]]))[0, 0]
        assert found == pytest.approx(ladder(port, sheets, length, ends, covered), rel=2e-4)


def test_it_is_the_impedance_of_a_strip_with_sheets() -> None:
    sheets = {"sheet_resistance_1": 5.0, "sheet_resistance_2": 2.0, "cells": 40, "contact_length": 5e-3}
    clean = ilg.impedance(ilg.PAPER.with_(electrodes=sheets), "1 mHz", "10 Hz", engine="exact", beam="static")
    fit = ilg.identify_sheets(
        Spectrum("strip", clean.frequency, clean.impedance),
        "30mm",
        width="5mm",
        model="rc",
        contact_length="5mm",
    )
    assert fit["sheet_resistance"].value == pytest.approx(7.0, rel=1e-3)


@pytest.mark.parametrize("sheets", [0.244, 1.0, 5.0])
def test_exact_spectra_of_two_lengths_give_it_back(sheets: float) -> None:
    fit = ilg.identify_sheets(
        [spectrum(sheets, 0.02), spectrum(sheets)], ["20 mm", LENGTH], "paper", width=WIDTH, model="rc"
    )
    assert fit["sheet_resistance"].value == pytest.approx(2 * sheets, rel=1e-6)
    assert fit["resistance_per_length"].value == pytest.approx(2 * sheets / WIDTH, rel=1e-6)
    found = [fit[name].value for name in RC.kind.names]
    np.testing.assert_allclose(found, PORT, rtol=1e-6)
    assert fit.separable
    assert fit.gamma_length == pytest.approx(np.abs(np.sqrt(2 * sheets / WIDTH * admittance(F))).max() * LENGTH)


@pytest.mark.parametrize(
    ("sheets", "lengths", "expected"),
    [
        (0.244, (LENGTH,), 0.59),
        (1.0, (LENGTH,), 0.038),
        (5.0, (LENGTH,), 0.0027),
        (0.244, (0.02, LENGTH), 0.0062),
    ],
)
def test_standard_error_at_a_noise_of_a_thousandth(sheets: float, lengths: tuple[float, ...], expected: float) -> None:
    # a small noise, at whose fit the slopes are those at the truth; its errors are in proportion
    data = tuple(ImpedanceData.of(spectrum(sheets, length, 1e-6, 20 + k)) for k, length in enumerate(lengths))
    problem = RC.problem(data, lines(*lengths))
    fit = _result(problem, least_squares(problem, np.log([*PORT, 2 * sheets]))[0])
    relative = fit.errors[-1] / fit.values[-1] / fit.deviation * 1e-3
    assert relative == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize(("sheets", "lengths"), [(5.0, (LENGTH,)), (1.0, (0.02, LENGTH))])
def test_intervals_hold_the_resistance_in_95_of_100_sets(sheets: float, lengths: tuple[float, ...]) -> None:
    inside, start = 0, np.log([*PORT, 2 * sheets])
    clean = tuple(ImpedanceData.of(spectrum(sheets, length)) for length in lengths)
    for seed in range(100):
        data = tuple(
            ImpedanceData(noisy, noisy, d.check, 0.0, noisy.source)
            for k, (d, length) in enumerate(zip(clean, lengths, strict=True))
            for noisy in [spectrum(sheets, length, 1e-3, 2 * seed + k)]
        )
        problem = RC.problem(data, lines(*lengths))
        low, high = _result(problem, least_squares(problem, start)[0]).intervals[-1]
        inside += low < 2 * sheets < high
    assert binom.ppf(0.005, 100, 0.95) <= inside <= binom.ppf(0.995, 100, 0.95)


def test_one_spectrum_of_good_sheets_does_not_tell_them_and_says_what_would() -> None:
    for sheets in (1e-9, 0.244):
        fit = ilg.identify_sheets(spectrum(sheets, noise=1e-3, seed=4), "35mm", width=WIDTH, model="rc")
        low, high = fit["sheet_resistance"].interval or (1.0, 1.0)
        assert low == 0 < 2 * sheets < high < 1.0
        assert not fit.separable
        assert {"sheets-in-series", "sheets-other-length", "sheets-no-frequency"} <= codes(fit.findings)
        # what takes its place is no better known
        low, high = fit["dynamic_resistance"].interval or (0.0, 0.0)
        assert low < PORT[1] < high
        assert high - low > 0.5 * high * 2 * sheets / WIDTH * LENGTH / 3 / PORT[1]
    advised = next(f.values for f in fit.findings if f.code == "sheets-other-length")
    both = [spectrum(0.244, noise=1e-3, seed=4), spectrum(0.244, advised["length"], 1e-3, 5)]
    better = ilg.identify_sheets(both, [LENGTH, advised["length"]], width=WIDTH, model="rc")
    assert better.separable
    assert not better.findings
    assert 1.96 * (better["sheet_resistance"].stderr or 0.0) == pytest.approx(advised["error"], rel=0.3)


def test_two_lengths_of_sheets_without_resistance_give_a_limit() -> None:
    both = [spectrum(1e-9, 0.02, 1e-3, 1), spectrum(1e-9, LENGTH, 1e-3, 2)]
    fit = ilg.identify_sheets(both, [0.02, LENGTH], width=WIDTH, model="rc")
    low, high = fit["sheet_resistance"].interval or (1.0, 1.0)
    assert low == 0 < high < 0.02
    assert fit.separable
    assert codes(fit.findings) == {"sheets-in-the-noise"}


def test_spectra_of_long_lines_give_a_lower_limit() -> None:
    f = np.geomspace(1e-2, 100, 40)
    fit = ilg.identify_sheets(spectrum(2e3, noise=1e-3, f=f), LENGTH, width=WIDTH, model="rc")
    low, high = fit["sheet_resistance"].interval or (0.0, 0.0)
    assert 0 < low < 4e3
    assert high == np.inf
    assert not fit.separable
    assert "sheets-too-long" in codes(fit.findings)
    assert json.loads(json.dumps(fit.to_dict(), allow_nan=False))["parameters"]["sheet_resistance"]


def test_leads_that_are_fitted_need_more_lengths_than_leads_that_are_known() -> None:
    pieces = [0.01, 0.02, LENGTH]
    spectra = [spectrum(0.244, length, 1e-3, 7 + k) for k, length in enumerate(pieces)]
    for each in spectra:
        each.impedance[:] += 3.0
    how = {"width": WIDTH, "model": "rc"}
    held = ilg.identify_sheets(spectra[1:], pieces[1:], **how, electrode_resistance="3 ohm")  # type: ignore[arg-type]
    two = ilg.identify_sheets(spectra[1:], pieces[1:], **how, electrode_resistance="fit")  # type: ignore[arg-type]
    three = ilg.identify_sheets(spectra, pieces, **how, electrode_resistance="fit")  # type: ignore[arg-type]
    assert (held.separable, two.separable, three.separable) == (True, False, True)
    assert three["electrode_resistance"].value == pytest.approx(3.0, rel=0.05)
    for fit in (held, two, three):
        low, high = fit["sheet_resistance"].interval or (0.0, 0.0)
        assert low < 0.488 < high


def test_command(run: Run) -> None:
    for length in (0.02, LENGTH):
        z = spectrum(1.0, length, 2e-3, 3)
        columns = {"frequency_Hz": z.frequency, "re_ohm": z.impedance.real, "im_ohm": z.impedance.imag}
        write_csv(f"{1e3 * length:.0f}mm.csv", columns)
    done = run(
        *("identify", "20mm.csv", "35mm.csv", "--sheets", "--lengths", "20mm,35mm", "--width", "5mm"),
        *("--json", "fit.json", "--plot", "fit.png"),
    )
    assert done.code == 0, done.err
    assert "separable yes" in done.out
    content = json.loads(Path("fit.json").read_text())
    low, high = content["parameters"]["sheet_resistance"]["ci95"]
    assert low < 2.0 < high < 1.1 * 2.0
    assert (content["model"], content["separable"]) == ("rc", True)
    assert Path("fit.png").stat().st_size > 10_000
    for line, word in (
        (("--sheets", "--lengths", "20mm"), "--width"),
        (("--sheets", "--width", "5mm"), "--lengths"),
        (("--sheets", "--width", "5mm", "--lengths", "20mm,35mm"), "2 for 1"),
        (("--sheets", "--width", "5mm", "--lengths", "-1mm"), "more than zero"),
        (("--sheets", "--actuator", "paper", "--model", "rc+sinh"), "nonlinear"),
        (("--sheets", "--actuator", "paper", "--onset", "1s"), "--onset"),
        (("--sheets", "--shape"), "one of them"),
        (("--lengths", "20mm"), "--sheets"),
        (("--contact", "both"), "--sheets"),
    ):
        assert_one_line(run("identify", "20mm.csv", *line), word)


def test_refusals() -> None:
    z = spectrum(1.0)
    with pytest.raises(InputError, match="contact"):
        ilg.identify_sheets(z, LENGTH, "paper", contact="clamp")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="contact_length"):
        ilg.identify_sheets(z, LENGTH, "paper", contact_length="-1mm")
    with pytest.raises(InputError, match="too large"):
        ilg.identify_sheets(z, LENGTH, "paper", electrode_resistance="1 kohm")
    t = np.arange(-5.0, 20.0)
    step = {"time_s": t, "voltage_V": 1.0 * (t > 0), "current_A": np.exp(-t)}
    with pytest.raises(InputError, match="impedance spectra"):
        ilg.identify_sheets(step, LENGTH, "paper")
