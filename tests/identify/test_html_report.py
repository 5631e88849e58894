"""The HTML report: complete, self-contained, and safe against what a file's name may hold."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run
from ilg_circuit.identify.html_report import html, write_report
from spectrum_texts import csv

from ilg_circuit.fit.criteria import autocorrelations, residual_windows
from ilg_circuit.identify import Identification


@pytest.fixture(scope="module")
def page(step_fit: Identification) -> str:
    return html(step_fit, "ilg-circuit identify data.csv --report r.html")


def test_it_holds_everything(page: str, step_fit: Identification) -> None:
    for name in (*step_fit.parameters, *step_fit.derived):
        assert name in page
    assert "ilg-circuit identify data.csv --report r.html" in page
    assert "Rdc drive 0" in page, "the netlist"
    assert "[geometry]" in page, "the fitted strip"
    assert "PySpice 1." in page
    assert "asked for" in page, "the candidate and its verdict"


def test_it_needs_nothing_else(page: str) -> None:
    pictures = re.findall(r'src="([^"]*)"', page)
    assert len(pictures) == 2
    for source in pictures:
        head, _, data = source.partition(",")
        assert head == "data:image/png;base64"
        assert base64.b64decode(data).startswith(b"\x89PNG")
    assert not re.search(r"<script|<link|https?://", page)


def test_a_spectrum_has_one_too(run: Run) -> None:
    Path("s.csv").write_text(csv())
    outcome = run("identify", "s.csv", "--report", "s.html")
    assert outcome.code == 0, outcome.err
    page = Path("s.html").read_text(encoding="utf-8")
    assert "Kramers-Kronig check" in page
    assert "No point breaks the relations" in page
    for name in ("dc_resistance", "resistance_2", "BIC above the best", "relative_rms", "[geometry]", "Rdc drive 0"):
        assert name in page
    assert page.count("data:image/png;base64,") == 2
    assert not re.search(r"<script|<link|https?://", page)


def test_it_shows_the_figures_of_the_displacement(page: str, step_fit: Identification) -> None:
    figures = step_fit.figures
    assert figures is not None
    for row in figures.rows():
        for cell in row:
            assert f">{cell}</td>" in page


def test_a_name_is_text_and_no_markup(step_fit: Identification) -> None:
    measurement = replace(step_fit.measurement, source="<script>alert(1)</script>.csv")
    assert "<script>" not in html(replace(step_fit, measurement=measurement), "")


def test_it_is_written_whole(step_fit: Identification, tmp_path: Path, page: str) -> None:
    path = tmp_path / "report.html"
    write_report(step_fit, path, "ilg-circuit identify data.csv --report r.html")
    assert path.read_text(encoding="utf-8").splitlines()[0] == page.splitlines()[0]
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_windows_cover_all_residuals(step_fit: Identification) -> None:
    rows = step_fit.residual_windows["current"]
    residuals = step_fit.current.fit.residuals[step_fit.current.time >= 0]
    assert sum(w.count for w in rows) == len(residuals)
    assert sum(w.count * w.rms**2 for w in rows) == pytest.approx(float((residuals**2).sum()))


def test_windows_are_even_in_logarithm() -> None:
    time = np.concatenate([[-1.0], np.geomspace(1e-3, 10.0, 4001)])
    rows = residual_windows(time, time, 10.0)
    assert [w.end for w in rows] == pytest.approx([10 ** (k / 2) * 1e-2 for k in range(7)], rel=1e-12)
    assert [w.start for w in rows[1:]] == [w.end for w in rows[:-1]]
    assert rows[0].start == 0.0


def test_autocorrelation_of_noise_and_of_a_sine() -> None:
    noise = np.random.default_rng(5).standard_normal(2000)
    values = autocorrelations(noise)
    assert values[0] == 1.0
    assert np.abs(values[1:]).max() < 4.5 / np.sqrt(2000)
    sine = autocorrelations(np.sin(2 * np.pi * np.arange(2000) / 20))
    assert sine[20] == pytest.approx(1.0, abs=0.02)
    assert sine[10] == pytest.approx(-1.0, abs=0.02)
    assert autocorrelations(np.zeros(10))[0] == 1.0


def test_a_fit_leaves_its_covariance_in_the_strip(step_fit: Identification) -> None:
    uncertainty = step_fit.actuator.uncertainty
    assert uncertainty is not None
    for k, name in enumerate(uncertainty.names):
        p = step_fit.parameters[name]
        assert p.stderr is not None
        assert np.sqrt(uncertainty.covariance[k][k]) == pytest.approx(p.stderr / p.value, rel=1e-9)
