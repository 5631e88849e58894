"""What a measured file may hold: a record over time, an impedance spectrum, a load test; their columns and limits."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

#: quantity -> (SI unit, "" for a pure number; words that a column's name may be or end in, the first one preferred)
Quantities = dict[str, tuple[str, tuple[str, ...]]]

#: What rows at one time are: a mistake, an instrument's two readings of which the later stays, the edge of a drive.
REFUSED, LATER, EDGE = "refused", "later", "edge"


@dataclass(frozen=True)
class Kind:
    """One kind of data: the ``quantities`` its columns may hold, those ``required``, an ``example`` of a header.

    Of ``either`` one is required. Columns of ``used`` are not, but where one is there it must be readable. ``repeats``
    says what rows at one time are. Kinds are equal by ``name``. Files are refused above ``most_bytes``, and above
    ``most_rows`` where that is given.
    """

    name: str
    quantities: Quantities = field(compare=False)
    required: tuple[str, ...] = field(compare=False)
    example: str = field(compare=False)
    either: tuple[str, ...] = field(default=(), compare=False)
    used: tuple[str, ...] = field(default=(), compare=False)
    repeats: str = field(default=REFUSED, compare=False)
    most_bytes: int = field(default=300_000_000, compare=False)
    most_rows: int | None = field(default=None, compare=False)

    def requiring(self, *quantities: str) -> Kind:
        """Return the same kind with other required columns."""
        return replace(self, required=quantities)

    def drawn(self, *quantities: str) -> Kind:
        """Return the same kind as a drawn waveform has it: these columns alone matter, a time that stands twice is an
        edge.
        """
        return replace(self, required=quantities, used=(), repeats=EDGE)

    @property
    def needed(self) -> tuple[str, ...]:
        """The quantities that must be readable where a column names them."""
        return tuple(dict.fromkeys((*self.required, *self.either, *self.used)))


RECORD = Kind(
    "record",
    {
        "time": ("s", ("time", "t", "t_nominal")),
        "voltage": (
            "V",
            ("ewe-ece", "<ewe>", "ewe", "voltage", "potential", "u", "volt", "volts", "vf", "v", "e", "control"),
        ),
        "current": ("A", ("<i>", "current", "i", "im", "amps")),
        "displacement": ("m", ("displacement", "deflection", "position")),
        "force": ("N", ("force",)),
        "charge": ("C", ("charge",)),
    },
    ("time", "voltage", "current"),
    "time_s, voltage_V, current_mA, displacement_mm, force_N",
    used=("voltage", "current", "displacement"),
)

_RE = ("re(z)", "re", "z'", "z'(a)", "zre", "z_re", "zreal", "z_real", "re_z", "real", "real(z)", "z(re)", "real_part")
_IMAG = ("im(z)", "im", "z''", "z''(b)", 'z"', "zim", "z_im", "zimag", "z_imag", "im_z", "imag", "imag(z)", "z(im)")
_IM = (*_IMAG, "imaginary_part")

SPECTRUM = Kind(
    "spectrum",
    {
        "frequency": ("Hz", ("frequency", "freq", "f")),
        "re": ("ohm", (*_RE, "resistance")),
        "minus_im": ("ohm", (*(f"{sign}{word}" for sign in ("-", "minus_", "neg_") for word in _IM), "im(-z)")),
        "im": ("ohm", (*_IM, "reactance")),
    },
    ("frequency", "re"),
    "frequency_Hz, re_ohm, im_ohm",
    either=("minus_im", "im"),
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
    used=("true stress", "stress"),
)

#: The header of an export is looked for in so many lines.
PREAMBLE = 400
#: No row of names is longer.
LONGEST_HEADER = 10_000

_FREQUENCY = re.compile(r"(?:^|[,;\t\"\s])(?:frequency|freq|f)\s*(?:_|\[|\(|/|,)\s*[kmMG]?Hz", re.IGNORECASE)
_BARE_FREQUENCY = re.compile(r"(?:^|[,;\t\"\s])(?:frequency|freq)(?:[,;\t\"\s]|$)", re.IGNORECASE)
_OF_A_RECORD = re.compile(r"voltage|potential|(?:^|[,;\t])[ \"]{0,9}t(?:ime)?\s*[_/\[(]", re.IGNORECASE)
_REAL_PART = re.compile(r"(?:^|[^a-z])(?:z_?)?re(?:al)?(?:[^a-z]|$)|z['\u2019\u2032]", re.IGNORECASE)


def frequency_row(lines: Sequence[str]) -> int | None:
    """Return the line (from 0) whose names of columns have a frequency among them, None where there is none.

    Without a unit a frequency counts beside a real part only.
    """
    for k, line in enumerate(lines[:PREAMBLE]):
        if len(line) >= LONGEST_HEADER:
            continue
        if _FREQUENCY.search(line) or (_BARE_FREQUENCY.search(line) and _REAL_PART.search(line)):
            return k
    return None


def names_a_record(header: str) -> bool:
    """Tell whether names of columns have a voltage or a time among them."""
    return bool(_OF_A_RECORD.search(header[:LONGEST_HEADER]))


def names_a_spectrum(header: str) -> bool:
    """Tell whether columns, one a frequency, are those of a spectrum: a record may have the drive's frequency."""
    return not names_a_record(header) or bool(_REAL_PART.search(header[:LONGEST_HEADER]))
