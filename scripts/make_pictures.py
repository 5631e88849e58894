"""Makes the pictures of `docs/pictures` again: a fit with residuals, and a soft arm that moves.

`docs/pictures/strip_and_setup.svg` is drawn by hand and stays as it is.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import ilg_circuit as ilg
from ilg_circuit.report.axes import load_plainly
from ilg_circuit.report.motion import animate
from ilg_circuit.reproduce.demo import measured

FOLDER = Path(__file__).parents[1] / "docs" / "pictures"
#: Frames a second of the animation: few, so that the file stays small.
_FRAMES = 10.0


def make(folder: Path) -> list[Path]:
    """Write the pictures into ``folder`` and return their paths."""
    load_plainly()
    folder.mkdir(parents=True, exist_ok=True)
    fit, arm, moving = (folder / name for name in ("fit.png", "arm.png", "arm.gif"))
    with tempfile.TemporaryDirectory() as scratch:
        data = Path(scratch) / "measured.csv"
        data.write_text(measured(ilg.simulate("paper", "step:4V", "300 s", beam="static")), encoding="utf-8")
        ilg.identify(data, "paper").save(fit)
    # A strip thinner than the paper's, under a slower rhythm: its motion is large enough to be seen.
    thin = replace(ilg.PAPER, name="thin strip", geometry=replace(ilg.PAPER.geometry, thickness=0.2e-3))
    moved = ilg.arm("12.5 s", thin, rhythm="chain", slower=6.0, samples=251)
    moved.save(arm)
    animate(moved.motion, moving, frames_per_second=_FRAMES)
    return [fit, arm, moving]


if __name__ == "__main__":
    for path in make(FOLDER):
        print(f"{path}: {path.stat().st_size // 1000} kB")
