"""Writes animations: frames of one figure as .gif or .mp4."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from ..errors import InputError
from ..files import replacing, require_writable
from .axes import COLOURS, Figure, as_written
from .look import finish

#: Largest number of frames of an animation; a GIF with more would be too large to show.
MOST_FRAMES = 400
#: Resolution [dpi] of an animation, and the largest one where its size was given.
FRAME, _MOST_SHARP = 100, 200
#: Number of colours of a GIF, chosen from its last frame, which shows everything.
_GIF_COLOURS = 48


def require_animation(path: Path) -> None:
    """Raise InputError for an animation that cannot be written: folder, suffix, missing ffmpeg."""
    if path.suffix.lower() not in (".gif", ".mp4"):
        raise InputError(f"cannot animate '{path}': end its name in .gif or .mp4")
    if path.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise InputError(f"cannot animate '{path}': no ffmpeg here; install it, or end the name in .gif")
    require_writable(path)


def write_frames(
    figure: Figure,
    path: Path,
    frames: Sequence[int],
    draw: Callable[[int], None],
    moving: Sequence[Any],
    frames_per_second: float,
) -> None:
    """Write an animation: ``draw`` changes the ``moving`` artists of the ``figure`` for each of ``frames``.

    What is not among these is drawn once, and lies behind them. Those of one height are drawn in their order.
    The layout is that of the figure as it is given: computing it for each frame is slow and makes the picture jitter.
    """
    from matplotlib.animation import FFMpegWriter

    finish(figure, COLOURS)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    kind: Any = FFMpegWriter if path.suffix.lower() == ".mp4" else _gif_writer()
    writer = kind(fps=frames_per_second)
    with replacing(path) as temporary, writer.saving(figure, str(temporary), dpi=min(figure.dpi, _MOST_SHARP)):
        writer.fig = _Pictures(figure, moving, writer.dpi)
        for frame in frames:
            draw(frame)
            writer.grab_frame()


class _Pictures:
    """A figure for a writer of animations: what stands still is drawn once, and what is ``moving`` in front of it."""

    def __init__(self, figure: Figure, moving: Sequence[Any], dpi: float) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        figure.set_dpi(dpi)
        canvas: Any = FigureCanvasAgg(figure)
        self._moving = sorted(moving, key=lambda artist: artist.get_zorder())
        for artist in moving:
            artist.set_animated(True)
        canvas.draw()
        self._canvas, self._still = canvas, canvas.copy_from_bbox(figure.bbox)
        self.get_size_inches = figure.get_size_inches

    def set_size_inches(self, *size: float) -> None:
        """Keep the size, which the writer sets again before every frame."""

    def savefig(self, file: IO[bytes], **_: Any) -> None:
        """Write the pixels as they are now."""
        from matplotlib.text import Text

        self._canvas.restore_region(self._still)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
            for artist in self._moving:
                if isinstance(artist, Text):
                    as_written(artist)
                artist.draw(self._canvas.get_renderer())
        file.write(self._canvas.buffer_rgba())


@lru_cache(maxsize=1)
def _gif_writer() -> Any:
    """Return a writer of GIFs whose frames share a palette of few colours: files are a third as large."""
    from matplotlib.animation import PillowWriter
    from PIL.Image import Dither, Quantize

    class FewColours(PillowWriter):
        def finish(self) -> None:
            frames: list[Any] = vars(self)["_frames"]
            palette = frames[-1].quantize(_GIF_COLOURS, Quantize.MAXCOVERAGE)
            frames[:] = [frame.quantize(palette=palette, dither=Dither.NONE) for frame in frames]
            super().finish()

    return FewColours
