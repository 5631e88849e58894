"""The shape of a strip from the command simulate: its files, its mechanics, its errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line, columns
from PIL import Image

SHORT = ("simulate", "paper", "--drive", "step:4V", "--duration", "300s", "--samples", "4", "--engine", "exact")


def test_shape_picture_and_animation(run: Run) -> None:
    done = run(*SHORT, "--shape", "shape.csv", "--plot-shape", "shape.png", "--animate", "strip.gif")
    assert done.code == 0, done.err
    table = columns(Path("shape.csv"))
    assert list(table) == ["time_s", "s_m", "x_m", "y_m", "theta_rad"]
    np.testing.assert_array_equal(np.unique(table["time_s"]), [0, 100, 200, 300])
    last = {name: values[-1] for name, values in table.items()}
    assert (last["s_m"], last["x_m"], last["y_m"]) == pytest.approx((0.03, 29.64914e-3, 3.95719e-3), abs=5e-9)
    assert "tip at the end" in done.out
    assert "(29.649 mm, 3.9572 mm)" in done.out
    with Image.open("strip.gif") as film, Image.open("shape.png") as picture:
        assert getattr(film, "n_frames", 1) > 1
        assert picture.size[0] > 300


def test_levels_of_mechanics(run: Run) -> None:
    load = ("--load", "stiffness=0.05mN/m")
    free = run(*SHORT, *load, "--shape", "free.csv", "--mechanics", "free")
    bent = run(*SHORT, *load, "--shape", "bent.csv")
    assert "without weight and load" in free.err
    assert bent.err == ""
    y, held = (columns(Path(name))["y_m"][-1] for name in ("free.csv", "bent.csv"))
    assert 0.4 * y < held < 0.6 * y


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--mechanics", "free"), "--shape"),
        (("--shape", "shape.png"), "CSV"),
        (("--animate", "strip.png"), ".gif"),
        (("--shape", "same.csv", "--out", "same.csv"), "same.csv"),
        (("--shape", "-"), "--json"),
    ],
)
def test_errors_are_one_line(run: Run, options: tuple[str, ...], words: str) -> None:
    assert_one_line(run(*SHORT, *options), words)
