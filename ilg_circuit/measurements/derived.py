"""Converts equivalent quantities of a file: modulus and phase, admittance; strains, forces and displacements."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..errors import InputError, argument
from ..units import scale
from .kind import Kind
from .table import Table

_SIZE = re.compile(
    r"[\"\s]{0,4}(?P<what>(?:gau?ge |initial |grip |specimen |parallel |clamping )?length|width|thickness|diameter"
    r"|area|section|cross[- ]section(?:al area)?|querschnitt|breite|dicke|(?:einspann|mess)l[\u00e4a]nge|[lsab]0)"
    r"\s{0,4}(?:[\[(](?P<before>[a-z\u00b2^2]{1,5})[\])])?[\":=,;\t ]{1,8}(?P<value>\d{1,9}(?:[.,]\d{1,9})?)"
    r"[\",;\t ]{0,8}(?P<after>(?:mm|cm|m|in)(?:\u00b2|\^?2)?)?[\",;\t ]{0,20}",
    re.IGNORECASE,
)

#: A whole turn [deg]; no passive port turns a phase by more.
_TURN = 360.0
_GERMAN = {"breite": "width", "b0": "width", "dicke": "thickness", "a0": "thickness"}


def impedance_of(table: Table, kind: Kind) -> Table:
    """Return the table of a spectrum converted to ``frequency``, ``re`` and ``im`` [ohm]."""
    columns, headers = dict(table.columns), dict(table.headers)
    way = kind.way(columns)
    first, second = (columns.pop(q) for q in way)
    if way[0] == "re":
        re_, im = first, second if way[1] == "im" else -second
    else:
        with np.errstate(all="ignore"):
            if way[0] == "modulus":
                _require_radians(second, headers[way[1]], table.source)
                turn = np.radians(second if way[1] == "phase" else -second)
                z = first * np.exp(1j * turn)
            else:
                z = 1 / (first + 1j * (second if way[1] == "im_y" else -second))
        re_, im = z.real.copy(), z.imag.copy()
    told = dict(zip(("re", "im"), (headers.pop(q) for q in way), strict=True))
    kept = {"frequency": columns["frequency"], "re": re_, "im": im}
    return replace(table, columns=kept, headers={"frequency": headers["frequency"], **told})


def _require_radians(phase: Array, header: tuple[str, str], name: str) -> None:
    """Raise InputError for a ``phase`` [deg] beyond a whole turn that was stated in radians: it is in degrees."""
    largest = float(np.abs(phase).max(initial=0.0, where=np.isfinite(phase)))
    if "rad" in header[1].lower() and largest > _TURN:
        raise InputError(
            f"{name}: column '{header[0][:80]}' reaches {np.radians(largest):.3g} rad, more than a whole turn: it is "
            "in degrees, as it seems; call it phase_deg"
        )


def stretch_of(table: Table, kind: Kind, above: Sequence[str] = ()) -> Table:
    """Return the table of a load test with ``stretch`` and ``stress`` or ``true stress`` [Pa].

    The length and the section of the specimen are the stated ones, or are read from the lines ``above`` the table.

    Raises
    ------
    InputError
        A displacement without a length, or a force without a section.
    """
    columns, headers = dict(table.columns), dict(table.headers)
    deformed, loaded = kind.way(columns)
    x, y = columns.pop(deformed), columns.pop(loaded)
    told = {"stretch": headers.pop(deformed), (loaded if loaded == "true stress" else "stress"): headers.pop(loaded)}
    sizes = _sizes(above)
    pressed = "compressi" in f"{table.headers[deformed][0]} {table.headers[loaded][0]}".lower()
    match deformed:
        case "strain":
            x = 1 + x
        case "compression":
            x = 1 - np.abs(x)
        case "true strain":
            x = np.exp(np.clip(x, -100, 100))
        case "displacement":
            length = kind.said.length or sizes.get("length")
            if not length:
                raise InputError(
                    f"{table.source}: its column '{table.headers[deformed][0]}' is a displacement; give the specimen's "
                    f"free length with {argument('length', '20mm')}"
                )
            x = 1 + (-np.abs(x) if pressed else x) / length
    if loaded == "force":
        section = kind.said.section or sizes.get("section")
        if not section:
            raise InputError(
                f"{table.source}: its column '{table.headers[loaded][0]}' is a force; give the specimen's undeformed "
                f"section with {argument('section', '10mm^2')}"
            )
        y = y / section
    if loaded == "pressure" or (pressed and loaded == "force"):
        y = -np.abs(y)
    return replace(table, columns={"stretch": x, next(k for k in told if k != "stretch"): y}, headers=told)


def _sizes(lines: Sequence[str]) -> dict[str, float]:
    """Return the length [m] and the section [m^2] of a specimen that lines of text give."""
    found: dict[str, float] = {}
    for line in lines:
        match = _SIZE.fullmatch(line[:200])
        unit = (match["before"] or match["after"]) if match else None
        if match is None or unit is None:
            continue
        what = match["what"].lower()
        area = re.search(r"area|section|querschnitt|s0", what)
        try:
            factor = float(scale(re.sub("\u00b2|\\^?2$", "^2", unit), "m^2" if area else "m"))
        except InputError:
            continue
        value = float(match["value"].replace(",", ".")) * factor
        name = "section" if area else "length" if re.search(r"l[\u00e4ae]ng|l0", what) else what
        found.setdefault(_GERMAN.get(name, name), value)
    if "section" not in found and {"width", "thickness"} <= set(found):
        found["section"] = found["width"] * found["thickness"]
    if "section" not in found and "diameter" in found:
        found["section"] = np.pi / 4 * found["diameter"] ** 2
    return found
