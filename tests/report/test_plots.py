"""Pictures: every axis with name and unit, files whole or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.report.plots import engineering, plot_response
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.strip.actuator import PAPER, Actuator

T = np.linspace(0, 100, 51)
SIGNATURES = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


@pytest.fixture(scope="module")
def response() -> Response:
    return simulate(PAPER, parse_drive("step:4V", 100.0), T, engine="exact")


@pytest.mark.parametrize(("suffix", "signature"), SIGNATURES.items())
def test_every_format(response: Response, tmp_path: Path, suffix: str, signature: bytes) -> None:
    plot_response(response, tmp_path / f"run{suffix}")
    assert (tmp_path / f"run{suffix}").read_bytes().startswith(signature)
    assert len(list(tmp_path.iterdir())) == 1


def test_axes_have_names_and_units(response: Response, tmp_path: Path) -> None:
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none"}):  # text as text
        plot_response(response, tmp_path / "run.svg")
    text = (tmp_path / "run.svg").read_text(encoding="utf-8")
    for label in ("current [mA]", "charge [C]", "displacement [mm]", "energy [J]", "voltage [V]", "time [s]"):
        assert label in text
    assert "force" not in text  # a free tip has none
    assert "step 4 V" in text


def test_what_is_not_known_is_not_drawn(strips: dict[str, Actuator], tmp_path: Path) -> None:
    import matplotlib

    known = simulate(strips["no coupling"], parse_drive("step:4V", 100.0), T, engine="exact")
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        plot_response(known, tmp_path / "run.svg")
    assert "displacement" not in (tmp_path / "run.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["run.gif", "run", "run.png.txt"])
def test_other_formats_are_refused(response: Response, tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"end its name in \.png, \.pdf or \.svg"):
        plot_response(response, tmp_path / name)
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
