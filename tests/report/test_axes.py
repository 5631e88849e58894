"""Pictures: readable units, files whole or not at all, their origin inside."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.errors import InputError
from ilg_circuit.provenance import Provenance
from ilg_circuit.report.axes import distinct, engineering, new_figure, save

SIGNATURES = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


@pytest.mark.parametrize(("suffix", "signature"), SIGNATURES.items())
def test_every_format_with_its_origin(tmp_path: Path, suffix: str, signature: bytes) -> None:
    figure, _ = new_figure(1, [1.0])
    save(figure, tmp_path / f"run{suffix}", Provenance(call="ilg-circuit simulate paper"))
    written = (tmp_path / f"run{suffix}").read_bytes()
    assert written.startswith(signature)
    assert b"ilg_circuit" in written
    assert b"call: ilg-circuit simulate paper" in written
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("name", ["run.gif", "run", "run.png.txt"])
def test_other_formats_are_refused(tmp_path: Path, name: str) -> None:
    figure, _ = new_figure(1, [1.0])
    with pytest.raises(InputError, match=r"end its name in \.png, \.pdf or \.svg"):
        save(figure, tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("largest", "unit", "factor", "label"),
    [
        (0.2, "A", 1e3, "mA"),
        (4e-3, "m", 1e3, "mm"),
        (1.75e-7, "N", 1e9, "nN"),
        (2.5e-6, "N", 1e6, "\N{MICRO SIGN}N"),
        (12.0, "J", 1.0, "J"),
        (2500.0, "V", 1e-3, "kV"),
        (6.3e6, "Pa", 1e-6, "MPa"),
        (0.0, "N", 1.0, "N"),
        (1e-15, "N", 1e15, "fN"),
        (1e-17, "N", 1e15, "fN"),
        (1e-3, "m", 1e3, "mm"),
    ],
)
def test_readable_units(largest: float, unit: str, factor: float, label: str) -> None:
    found, text = engineering(np.array([0.0, -largest, np.nan]), unit)
    assert found == pytest.approx(factor)
    assert text == label


def test_a_long_record_is_drawn_by_points_that_do_not_hide_each_other() -> None:
    x = np.linspace(0.0, 100.0, 200_000)
    y = np.sin(x) + 0.01 * np.random.default_rng(1).standard_normal(len(x))
    assert np.array_equal(distinct(x[:1000], y[:1000]), np.arange(1000))
    for logarithmic in (False, True):
        rows = distinct(x, y, logarithmic=logarithmic)
        assert len(rows) < 0.3 * len(x)
        assert (np.diff(rows) > 0).all()
        place = np.log(x[rows]) if logarithmic else x[rows]
        # every point has a drawn one within a cell, by the extremes of the curve
        assert abs(float(y[rows].max() - y.max())) < 0.02
        assert float(np.diff(place).max()) < (1.0 if logarithmic else 0.1)


@pytest.mark.parametrize(("first", "last", "labels"), [(1.0, 9.0, "2 3 4 5 6 7 8 9"), (0.02, 30.0, "0.1 1 10")])
def test_times_of_a_step_are_plain_numbers(first: float, last: float, labels: str) -> None:
    after = np.geomspace(first, last, 60)
    time = np.concatenate([[-3.0, -2.0, -1.0, -0.5], after]) + 4.0
    current = np.where(time < 4.0, 0.0, 1e-3 + 0.1 * np.exp(-(time - 4.0) / 3.0))
    random = np.random.default_rng(0)
    record = {
        "time_s": time,
        "voltage_V": np.where(time < 4.0, 0.0, 2.0),
        "current_A": current + 1e-4 * random.standard_normal(len(time)),
    }
    drawn = ilg.identify(record, "paper", model="rc", onset=4.0, engine="exact").figure()
    drawn.draw_without_rendering()
    axis = drawn.axes[-1].xaxis
    found = [tick.label1.get_text() for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())]
    assert set(labels.split()) <= set(found)
    assert not [text for text in found if "$" in text]
    assert not [tick for panel in drawn.axes[:-1] for tick in panel.xaxis.get_minor_ticks()]
