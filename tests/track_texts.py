"""One tip's track as cameras' programs write it: 300 frames at 25 Hz, the tip moving at 20 degrees to the x axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ilg_circuit.measurements.said import Said, said_of

T = np.arange(300) / 25
#: The displacement [m], and a pixel [m].
Y = np.where(T < 2, 0.0, 2e-3 * (1 - np.exp(-np.maximum(T - 2, 0.0) / 3)))
PIXEL, ANGLE = 42e-6, np.radians(20.0)
X_PX, Y_PX = 300 + Y / PIXEL * np.cos(ANGLE), 200 + Y / PIXEL * np.sin(ANGLE)


def timecode(t: float) -> str:
    return f"{int(t // 3600)}:{int(t // 60) % 60:02d}:{int(t) % 60:02d}:{round(100 * (t % 1)):02d}"


def table(*columns: Sequence[object], sign: str = ",", comma: bool = False, code: str = "{:.12g}") -> str:
    rows = ([c if isinstance(c, str) else code.format(c) for c in row] for row in zip(*columns, strict=True))
    text = "".join(sign.join(row) + "\n" for row in rows)
    return text.replace(".", ",") if comma else text


def deeplabcut(unsure: Sequence[int] = (), individuals: bool = False) -> str:
    parts = ["base", "tip"]
    head = [["scorer", *["DLC_resnet50"] * 6], ["individuals", *["gel"] * 6]][: 1 + individuals]
    head += [["bodyparts", *(p for p in parts for _ in range(3))], ["coords", *["x", "y", "likelihood"] * 2]]
    likely = np.full(len(T), 0.99)
    x = X_PX.copy()
    likely[list(unsure)], x[list(unsure)] = 0.1, 900.0
    still = np.full(len(T), 7.0)
    return "".join(",".join(row) + "\n" for row in head) + table(range(len(T)), still, still, likely, x, Y_PX, likely)


MM = (1e3 * PIXEL * X_PX, 1e3 * PIXEL * Y_PX)

#: Name of a track -> its text and what is said of it, as options of the front door.
TRACKS: dict[str, tuple[Callable[[], str], dict[str, object]]] = {
    "DeepLabCut": (deeplabcut, {"part": "tip", "fps": 25, "scale": "0.042mm/px"}),
    "DeepLabCut, individuals": (
        lambda: deeplabcut(individuals=True),
        {"part": "gel tip", "fps": 25, "scale": PIXEL},
    ),
    "Tracker": (
        lambda: "mass A\t\t\nt\tx\ty\n" + table(T, *MM, sign="\t", code="{:.12E}"),
        {"units": {"displacement": "mm"}},
    ),
    "Tracker, two tracks, decimal commas": (
        lambda: "base;;;tip;;\nt;x;y;t;x;y\n" + table(T, 0 * T, 0 * T, T, *MM, sign=";", comma=True),
        {"part": "tip", "units": {"displacement": "mm"}},
    ),
    "Kinovea": (
        lambda: "#Kinovea Trajectory data export\n#T X Y\n" + table([*map(timecode, T)], X_PX, Y_PX, sign=" "),
        {"scale": "0.042mm/px"},
    ),
    "Kinovea, CSV": (
        lambda: "Time (ms);Trajectory 1/X (mm);Trajectory 1/Y (mm)\n" + table(1e3 * T, *MM, sign=";", comma=True),
        {},
    ),
    "Kinovea, timecodes": (
        lambda: "Time\tX\tY\n" + table([*map(timecode, T)], X_PX, Y_PX, sign="\t"),
        {"scale": "0.042mm/px"},
    ),
    "CSV, pixels": (lambda: "time_s,x_px,y_px\n" + table(T, X_PX, Y_PX), {"scale": f"{1e-3 / PIXEL!r}px/mm"}),
    "CSV, frames": (
        lambda: "Frame,X (px),Y (px)\n" + table(range(len(T)), X_PX, Y_PX),
        {"fps": 25, "scale": "42um/px"},
    ),
    "CSV, displacement": (lambda: "time [ms];displacement [mm]\n" + table(1e3 * T, 1e3 * Y, sign=";", comma=True), {}),
    "CSV, one coordinate": (lambda: "t_s,x_mm\n" + table(T, 1e3 * Y), {"axis": "x"}),
    "CSV, an angle": (lambda: "time_s,x_mm,y_mm\n" + table(T, *MM), {"axis": "20deg"}),
}


def track_said(name: str) -> Said:
    """Return what is said of a track, as its reader takes it."""
    how: dict[str, Any] = dict(TRACKS[name][1])
    rate = how.pop("fps", None)
    return said_of(**how, rate=rate).of_track
