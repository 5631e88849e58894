"""Frames of an animation, in which what stands still is drawn once, against whole drawings."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from ilg_circuit.report.animation import _Pictures
from ilg_circuit.report.axes import blank


def test_a_frame_is_what_a_whole_drawing_is() -> None:
    figure = blank((4.0, 2.0), dpi=100)
    panel = figure.subplots()
    panel.set(xlim=(0, 10), ylim=(-1, 1), xlabel="x [mm]")
    (patch,) = panel.fill([0, 0, 0], [0, 0, 0], color="C1", zorder=1)
    post = panel.plot([5, 5], [-0.8, 0.8], color="black", linewidth=4)[0]  # behind the line, in front of the patch
    line, title = panel.plot([], [], linewidth=2.0)[0], panel.set_title("")
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    pictures = _Pictures(figure, (post, line, title, patch), 100.0)

    def frame(k: int) -> bytes:
        line.set_data([1, 5, 9], [-0.5, 0.1 * k, 0.5])
        patch.set_xy([[4, -0.5], [6, -0.5], [5, 0.1 * k]])
        title.set_text(f"$strip\x1b[31m_{k}$: {k} s")  # as a user may call it
        found = BytesIO()
        pictures.savefig(found)
        return found.getvalue()

    first, last = frame(0), frame(5)
    assert first != last
    assert frame(0) == first  # nothing of the frame before is left
    assert title.get_text() == "$strip\\x1b[31m_0$: 0 s"
    for artist in (post, line, title, patch):
        artist.set_animated(False)
    whole = FigureCanvasAgg(figure)
    whole.draw()
    pixels = np.frombuffer(first, dtype=np.uint8).reshape(np.asarray(whole.buffer_rgba()).shape)
    assert (pixels == np.asarray(whole.buffer_rgba())).all()
    assert pictures.get_size_inches().tolist() == [4.0, 2.0]
