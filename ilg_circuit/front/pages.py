"""A strip as an HTML page that runs in any browser."""

from __future__ import annotations

from pathlib import Path

from ..browser.page import strip_page
from ..files import require_writable, write_text
from ..provenance import Provenance
from ..strip.electrodes import require_lump
from .given import Given, Strip, quantity
from .given import load as strip_of


def page(
    strip: Strip,
    out: str | Path,
    drive: str = "step:4V",
    duration: Given = "300 s",
    *,
    beam: str | None = None,
    origin: Provenance | None = None,
) -> Path:
    """Write a strip as one HTML file with sliders, in which ngspice solves the strip; it needs no network.

    The page compares its first run with what the package computes of the same strip, and states the difference.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    out : str or Path
        The file to write, replaced whole or not at all.
    drive : str
        Drive shown first: a step, square, sine or triangle, written as in `simulate`.
    duration : float or str
        Duration of the run [s].
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    origin : Provenance, optional
        Origin of the page, written at the head of its decks.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        A value is not understood, a page has no such drive, or the file cannot be written.
    MissingLibraryError
        This installation has no ngspice for the browser; the message says how npm fetches it.
    SolveError
        The strip cannot be solved.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> ilg.page("paper", "strip.html", "chirp:1V,1Hz..2Hz")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    ilg_circuit.errors.InputError: a page has the drives step, square, sine, triangle, not 'chirp'; ...
    """
    path = Path(out)
    require_writable(path)
    actuator = strip_of(strip)
    require_lump(actuator, "a page")
    write_text(path, strip_page(actuator, drive, quantity(duration, "s", "duration"), beam, origin))
    return path
