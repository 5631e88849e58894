"""The HTML report of any kind of data: complete, self-contained, and safe against what a file's name may hold."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kinds import KINDS, data, identified

from ilg_circuit.fit.criteria import autocorrelations, residual_windows
from ilg_circuit.identification import identify
from ilg_circuit.provenance import Provenance
from ilg_circuit.report.displacement_metrics import metrics_rows
from ilg_circuit.report.page import render, write_page

CALL = "ilg-circuit identify data.csv --report r.html"


@pytest.fixture(scope="module", params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def page(kind: str) -> str:
    return render(replace(identified(kind), provenance=Provenance(call=CALL)).page())


def test_it_holds_everything(page: str, kind: str) -> None:
    result = identified(kind)
    for name in (*result.parameters, *result.derived):
        assert name in page
    assert CALL in page
    assert "Rdc drive 0" in page, "the netlist"
    assert "[geometry]" in page, "the fitted strip"
    assert "PySpice 1." in page
    assert "asked for" in page, "the candidate and its verdict"
    assert "BIC above the best" in page
    assert "from the others" in page
    for o in result.observations:
        assert f"<td>{o.source}</td>" in page
        assert f"{o.rms_joint / o.size:.2%}" in page
    assert ("Kramers-Kronig check" in page) == (kind in ("spectrum", "several"))
    assert ("No point was left out" in page) == (kind in ("spectrum", "several"))
    for row in metrics_rows(result.metrics) if result.metrics else ():
        for cell in row:
            assert f">{cell}</td>" in page


def test_it_needs_nothing_else(page: str) -> None:
    pictures = re.findall(r'src="([^"]*)"', page)
    assert len(pictures) == 2
    for source in pictures:
        head, _, content = source.partition(",")
        assert head == "data:image/png;base64"
        assert base64.b64decode(content).startswith(b"\x89PNG")
    assert not re.search(r"<script|<link|https?://", page)


@pytest.mark.parametrize("what", ["step", "spectrum"])
def test_a_name_is_text_and_no_markup(what: str) -> None:
    (file,) = data(what)
    named = identify(replace(file, source="<script>alert(1)</script>.csv"), model="rc", engine="exact")
    assert "<script>" not in render(named.page())


def test_it_is_written_whole(tmp_path: Path) -> None:
    page = identified("spectrum").page()
    write_page(page, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8").splitlines()[0] == render(page).splitlines()[0]
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.parametrize("quantity", ["current", "displacement"])
@pytest.mark.parametrize("what", ["step", "waveform"])
def test_windows_cover_all_residuals(what: str, quantity: str) -> None:
    result = identified(what)
    rows = result.residual_windows[quantity]
    (o,) = (o for o in result.observations if o.quantity == quantity)
    residuals = o.residuals[o.abscissa >= 0]
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
