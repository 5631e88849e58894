"""What a measured file may hold: a record over time, an impedance spectrum, a load test; their columns and limits."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

#: quantity -> (SI unit, "" for a pure number; words that a column's name may end in before its unit)
Quantities = dict[str, tuple[str, tuple[str, ...]]]


@dataclass(frozen=True)
class Kind:
    """One kind of data: the ``quantities`` its columns may hold, those ``required``, an ``example`` of a header.

    Kinds are equal by ``name``. Files are refused above ``most_bytes``, and above ``most_rows`` where that is given.
    """

    name: str
    quantities: Quantities = field(compare=False)
    required: tuple[str, ...] = field(compare=False)
    example: str = field(compare=False)
    most_bytes: int = field(default=300_000_000, compare=False)
    most_rows: int | None = field(default=None, compare=False)

    def requiring(self, *quantities: str) -> Kind:
        """Return the same kind with other required columns."""
        return replace(self, required=quantities)


RECORD = Kind(
    "record",
    {
        "time": ("s", ("time", "t", "t_nominal")),
        "voltage": ("V", ("voltage", "potential", "u")),
        "current": ("A", ("current", "i")),
        "displacement": ("m", ("displacement", "deflection", "position")),
        "force": ("N", ("force",)),
        "charge": ("C", ("charge",)),
    },
    ("time", "voltage", "current"),
    "time_s, voltage_V, current_mA, displacement_mm, force_N",
)

SPECTRUM = Kind(
    "spectrum",
    {
        "frequency": ("Hz", ("frequency", "freq", "f")),
        "re": ("ohm", ("re", "re(z)", "z_re", "zre", "zreal", "z_real", "real", "z'", "z'(a)")),
        "im": ("ohm", ("im", "im(z)", "z_im", "zim", "zimag", "z_imag", "imag", "z''", "z''(b)", 'z"')),
        "minus_im": ("ohm", ("-im", "-im(z)", "minus_im", "-z_im", "-zim", "-zimag", "-z''", '-z"', "-imag")),
    },
    ("frequency", "re"),
    "frequency_Hz, re_ohm, im_ohm",
    most_bytes=5_000_000,
    most_rows=20_000,
)

LOAD_TEST = Kind(
    "load test",
    {
        "stretch": ("", ("stretch", "stretch_ratio", "lambda")),
        "true stress": ("Pa", ("true_stress", "cauchy_stress")),  # before "stress": its name ends in that word too
        "stress": ("Pa", ("stress",)),
    },
    ("stretch",),
    "stretch, stress_MPa",
)

#: The header of an export is looked for in so many lines.
PREAMBLE = 400

_FREQUENCY = re.compile(r"\s*\"?\s*(?:frequency|freq|f)\s*(?:_|\[|\(|/)\s*[kmMG]?Hz", re.IGNORECASE)
_OF_A_RECORD = re.compile(r"voltage|potential|(^|[,;\t])\s*t(ime)?\s*[_/\[(]", re.IGNORECASE)
_REAL_PART = re.compile(r"(^|[^a-z])(z_?)?re(al)?([^a-z]|$)|z'", re.IGNORECASE)


def frequency_row(lines: Sequence[str]) -> int | None:
    """Return the line (from 0) whose names of columns have a frequency among them, None where there is none."""
    for k, line in enumerate(lines[:PREAMBLE]):
        if len(line) < 10_000 and any(_FREQUENCY.match(cell) for cell in re.split(r"[,;\t]|\s{2,}", line)):
            return k
    return None


def names_a_record(header: str) -> bool:
    """Tell whether names of columns have a voltage or a time among them."""
    return bool(_OF_A_RECORD.search(header))


def names_a_spectrum(header: str) -> bool:
    """Tell whether columns, one a frequency, are those of a spectrum: a record may have the drive's frequency."""
    return not names_a_record(header) or bool(_REAL_PART.search(header))
