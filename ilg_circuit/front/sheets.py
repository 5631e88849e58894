"""The resistance along a strip's electrodes, from impedance spectra of one length of it or of several."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..errors import InputError, argument, checked
from ..identification.sheets import SheetsFit
from ..identification.sheets import identify_sheets as fit_sheets
from ..identification.sheets_model import Contact
from ..measurements.said import said_of
from ..measurements.spectrum import Spectrum
from ..strip.actuator import Actuator
from ..strip.file import load_strip
from ..strip.specimen import Specimen
from ..units import si
from .data import Source, sets_of
from .given import Given, Strip, optional, quantity


@checked
def identify_sheets(
    spectra: Source | Sequence[Source],
    lengths: str | Given | Sequence[Given] | None = None,
    strip: Strip | Specimen | None = None,
    *,
    width: Given | None = None,
    model: str = "auto",
    contact: Contact = "end",
    contact_length: Given = 0.0,
    electrode_resistance: Given = 0.0,
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | None = None,
) -> SheetsFit:
    """Return the resistance along a strip's electrodes, from impedance spectra of one length of it or of several.

    Parameters
    ----------
    spectra : str, Path, DataFrame, mapping, Spectrum, or list of these
        Impedance spectra of one strip, or of pieces of it: paths, columns such as frequency_Hz, re_ohm, im_ohm, or what
        `read` returned.
    lengths : str, float or list, optional
        Length of the strip [m] in each, without what lies under the contacts, such as "20mm,35mm" (default: the
        strip's).
    strip : Actuator, str or Path, optional
        The strip, for its length and width: an object, the path of a TOML file or a preset's name.
    width : float or str, optional
        Its width [m], in place of a strip or of the strip's own.
    model : str
        Linear electrical model of the strip between its sheets, see `identify`; "auto" chooses by BIC.
    contact : {"end", "both"}
        Contact at one end of the length, or at both ends.
    contact_length : float or str
        Length of each contact [m]; the strip under it is at the contact's potential.
    electrode_resistance : float or str
        Resistance Re of leads and contacts [ohm], the same at all lengths; "fit" to fit it.
    columns : mapping of str to str, optional
        Titles of columns by quantity, if headers are not understood; as in `read`.
    units : mapping of str to str, optional
        Units by quantity, likewise.
    part : int, optional
        Which of several measurements in a file, see `read`.

    Returns
    -------
    SheetsFit
        ``fit["sheet_resistance"]`` [ohm], per square and of both sheets added, ``fit["resistance_per_length"]``
        [ohm/m]; ``fit.separable`` and ``fit.warnings`` say whether the data determine them. See `ilg.results`.

    Raises
    ------
    InputError
        The spectra cannot be read, lengths do not fit them, or the model is nonlinear.
    SolveError
        No fit converges.

    Notes
    -----
    Where abs(gamma L) is far below one, the sheets are a resistor of r L/3 in front of the strip, and one spectrum does
    not tell it from the strip's own resistances: the interval then reaches down to zero. Two lengths do.

    Examples
    --------
    >>> import numpy as np
    >>> import ilg_circuit as ilg
    >>> f = np.geomspace(1e-4, 100, 40)
    >>> y = (1 / 667 + 1 / (19.4 + 1 / (2j * np.pi * f * 0.35))) / 35e-3  # of a length of strip [S/m]
    >>> r = 2.0 / 5e-3  # 2 ohm per square on a width of 5 mm [ohm/m]
    >>> pieces = [np.sqrt(r / y) / np.tanh(np.sqrt(r * y) * length) for length in (20e-3, 35e-3)]
    >>> spectra = [{"frequency_Hz": f, "re_ohm": z.real, "im_ohm": z.imag} for z in pieces]
    >>> fit = ilg.identify_sheets(spectra, "20mm,35mm", width="5mm", model="rc")
    >>> fit.separable, f"{fit['sheet_resistance'].value:.4f} ohm"
    (True, '2.0000 ohm')
    """
    known = strip if strip is None or isinstance(strip, Actuator | Specimen) else load_strip(strip)
    sets = sets_of(spectra, said=said_of(columns, units, part, None))
    if wrong := next((each for each in sets if not isinstance(each, Spectrum)), None):
        raise InputError(
            f"{wrong.source}: is a {type(wrong).__name__}; give impedance spectra: columns frequency_Hz, re_ohm, im_ohm"
        )
    if known is None and width is None:
        raise InputError(f"the strip's width is missing; give {argument('width')}, or a strip that has it")
    across = quantity(width, "m", "width") if width is not None else known.geometry.width if known else np.nan
    if lengths is None and known is None:
        raise InputError(f"the strip's length is missing; give {argument('lengths')}, one for each spectrum")
    own = known.geometry.length if known is not None else None
    return fit_sheets(
        [each for each in sets if isinstance(each, Spectrum)],
        [own or np.nan] * len(sets) if lengths is None else _lengths(lengths),
        across,
        length=own,
        model=model,
        contact=contact,
        contact_length=quantity(contact_length, "m", "contact_length"),
        electrode_resistance=None
        if electrode_resistance == "fit"
        else optional(electrode_resistance, "ohm", "electrode_resistance"),
    )


def _lengths(given: str | Given | Sequence[Given]) -> list[float]:
    """Return the lengths [m] of a text, a number, or a list of either."""
    cells = given.split(",") if isinstance(given, str) else [given] if isinstance(given, float | int) else list(given)
    return [si(cell, "m", argument("lengths")) for cell in cells]
