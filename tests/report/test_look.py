"""Pictures for papers: their size, a style file, fonts that publishers take, text that can be read in a column."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.report.axes import COLOURS, blank, grid, save
from ilg_circuit.report.look import chosen, look, size_of
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.strip.actuator import PAPER

SIMULATE = ("simulate", "paper", "--engine", "exact", "--duration", "40s", "--samples", "81")
SQUARE = (*SIMULATE, "--drive", "square:-2V..2V,20s")


@pytest.fixture(scope="module")
def response() -> Response:
    return simulate(PAPER, PiecewiseLinear.square(-2.0, 2.0, 20.0, 40.0), np.linspace(0, 40, 81), engine="exact")


def box(pdf: bytes) -> np.ndarray:
    found = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", pdf)
    assert found
    return np.array([float(x) for x in found.groups()]) / 72 * 25.4


@pytest.mark.parametrize(("size", "wanted"), [("85mm,60mm", (85.0, 60.0)), ("17 cm", (170, None))])
def test_size_and_fonts(run: Run, size: str, wanted: tuple[float, float | None]) -> None:
    done = run(*SQUARE, "--plot", "run.pdf", "--size", size)
    assert done.code == 0, done.err
    pdf = Path("run.pdf").read_bytes()
    width, height = box(pdf)
    assert width == pytest.approx(wanted[0], abs=0.1)
    if wanted[1]:
        assert height == pytest.approx(wanted[1], abs=0.1)
    assert b"/Type3" not in pdf
    assert b"/CIDFontType2" in pdf or b"/TrueType" in pdf


def test_svg_holds_text(response: Response, tmp_path: Path) -> None:
    response.save(tmp_path / "run.svg", size=(0.085, 0.12))
    svg = (tmp_path / "run.svg").read_text(encoding="utf-8")
    assert ">current [mA]</text>" in svg
    assert float(re.search(r'width="([\d.]+)pt"', svg)[1]) / 72 * 25.4 == pytest.approx(85, abs=0.01)  # type: ignore[index]


def test_text_of_a_column_can_be_read(response: Response) -> None:
    with look(chosen("85mm")):
        figure = response.figure()
        figure.draw_without_rendering()
    sizes = {text.get_fontsize() for text in figure.findobj(Text) if isinstance(text, Text) and text.get_text()}
    assert min(sizes) >= 6
    assert max(sizes) <= 9
    for text in [figure._suptitle, *(panel.yaxis.label for panel in figure.axes)]:  # type: ignore[attr-defined]
        frame = text.get_window_extent()
        assert frame.x0 >= -1
        assert frame.x1 <= figure.bbox.x1 + 1


def test_a_style_file_gives_colours_widths_and_fonts(run: Run, response: Response) -> None:
    Path("journal.mplstyle").write_text(
        "axes.prop_cycle: cycler('color', ['black', 'purple'])\nlines.linewidth: 3\nfont.size: 12\nbackend: agg\n"
    )
    done = run(*SQUARE, "--plot", "run.png", "--style", "journal.mplstyle")
    assert done.code == 0, done.err
    plain, styled = response.plot("current"), response.plot("current", style="journal.mplstyle")
    lines = [axes.get_lines()[0] for axes in (plain, styled)]
    assert [to_hex(line.get_color()) for line in lines] == [COLOURS[0], "#000000"]
    assert lines[1].get_linewidth() == pytest.approx(2 * lines[0].get_linewidth())
    assert styled.yaxis.label.get_fontsize() == 12
    assert plain.yaxis.label.get_fontsize() == 10


@pytest.mark.parametrize(
    ("options", "hints"),
    [
        (("--size", "85"), ("--size", "85")),
        (("--size", "0mm"), ("20 mm to 1200 mm",)),
        (("--size", "5 m"), ("20 mm to 1200 mm",)),
        (("--size", "85mm,60mm,3mm"), ("85mm,60mm",)),
        (("--size", "300mm,25mm"), ("times the other",)),
        (("--size", "85V"), ("--size",)),
        (("--style", "missing.mplstyle"), ("missing.mplstyle",)),
        (("--style", "data.csv"), ("no matplotlib style file",)),
        (("--style", "empty"), ("no settings",)),
        (("--style", "binary"), ("no matplotlib style file",)),
        (("--style", "value"), ("no matplotlib style file",)),
    ],
)
def test_bad_sizes_and_styles_are_one_line(run: Run, options: tuple[str, str], hints: tuple[str, ...]) -> None:
    Path("data.csv").write_text("time_s,voltage_V\n0,1\n")
    Path("empty").write_text("# nothing\n")
    Path("binary").write_bytes(bytes(range(256)))
    Path("value").write_text("lines.linewidth: thick\n")
    assert_one_line(run(*SQUARE, "--plot", "run.png", *options), *hints)
    assert not Path("run.png").exists()


def test_a_size_without_a_picture_is_refused(run: Run, response: Response) -> None:
    assert_one_line(run(*SQUARE, "--out", "run.csv", "--size", "85mm"), "--plot")
    with pytest.raises(InputError, match=r"end its name in \.png"):
        response.save("run.csv", size="85mm")
    with pytest.raises(InputError, match="leave ax out"):
        response.plot(ax=Figure().subplots(), size="85mm")


def test_panels_on_axes_of_ones_own(response: Response) -> None:
    assert response.plot("current", ax=Figure().subplots()).get_ylabel() == "current [mA]"
    figure = Figure()
    drawn = response.plot(["charge", "voltage"], ax=figure.subplots(2, 1))
    assert [axes.get_ylabel() for axes in drawn] == ["charge [mC]", "voltage [V]"]
    assert [axes.get_ylabel() for axes in response.plot(figure.subplots(1, 2))] == ["displacement [µm]", "current [mA]"]
    with pytest.raises(InputError, match="3 axes for the panels charge, voltage"):
        response.plot(["charge", "voltage"], ax=figure.subplots(1, 3))


def test_jumps_are_vertical(response: Response) -> None:
    for name in ("current", "voltage"):
        (line,) = response.plot(name, ax=Figure().subplots()).get_lines()
        x, y = (np.asarray(data) for data in line.get_data())
        steep = np.abs(np.diff(y)) > 0.3 * np.ptp(y)
        assert steep.sum() == 4  # at 10, 20, 30 and 40 s
        assert np.diff(x)[steep].max() <= 1e-6


def test_the_note_says_why_the_tip_swings(response: Response) -> None:
    panel = next(axes for axes in response.figure().axes if axes.get_ylabel().startswith("displacement"))
    assert "swings at 220 mHz" in panel.get_title(loc="left")
    still = simulate(PAPER, response.drive, response.time, engine="exact", beam="static")
    assert all(not axes.get_title(loc="left") for axes in still.figure().axes)


def test_a_band_can_be_seen_in_print(response: Response) -> None:
    error = np.full(len(response.time), 0.05 * np.abs(response.charge).max())
    banded = Response(**vars(response) | {"stderr": {"charge": error}})
    axes = banded.plot("charge", ax=Figure().subplots())
    edges = [line for line in axes.get_lines() if isinstance(line, Line2D) and line.get_label() == "_"]
    assert len(edges) == 2
    assert axes.collections[0].get_label() == "95 % band of the fit"
    thin = Response(**vars(response) | {"stderr": {"charge": 1e-3 * error}})
    legends = [panel.get_legend() for panel in thin.figure().axes]
    (legend,) = (found for found in legends if found is not None)
    assert [text.get_text() for text in legend.get_texts()] == ["95 % band of the fit, within the line"]


def test_the_palette_holds_in_grey() -> None:
    first, second = (np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) for colour in COLOURS[:2])
    luminance = np.array([0.299, 0.587, 0.114])
    assert abs(float(luminance @ first - luminance @ second)) > 12
    assert len(set(COLOURS)) == len(COLOURS)


def test_sizes_in_inches() -> None:
    assert size_of("25.4mm") == (pytest.approx(1.0), None)
    with look(chosen("85mm")):
        assert blank((7.5, 5.0)).get_size_inches() == pytest.approx([85 / 25.4, 3.75])
    assert blank((7.5, 5.0)).get_size_inches() == pytest.approx([7.5, 5.0])


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_a_size_that_leaves_no_room_for_the_panels_is_one_line(tmp_path: Path, suffix: str) -> None:
    target = tmp_path / f"small.{suffix}"
    with look(chosen("40mm,20mm")):
        figure, panels = grid(4, 1, (6.0, 8.0))
        for panel in panels.flat:
            panel.set(xlabel="time [s]", ylabel="current [A]", title="a title")
        with pytest.raises(SolveError, match="40 mm x 20 mm is too small for its panels"):
            save(figure, target)
    assert not target.exists()
