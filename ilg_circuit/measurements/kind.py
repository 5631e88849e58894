"""Kinds of measured data, a record over time, an impedance spectrum, a load test, with their columns and limits."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from .said import NOTHING, TRACK_PREFIX, Said

#: quantity -> (SI unit, "" for a pure number; words that a column's name equals or ends in, the preferred one first)
Quantities = dict[str, tuple[str, tuple[str, ...]]]

#: Meaning of repeated times: an error, a double reading of which the later is kept, or the edge of a drive.
REFUSED, LATER, EDGE = "refused", "later", "edge"


@dataclass(frozen=True)
class Kind:
    """One kind of data: the ``quantities`` of its columns, the ``required`` ones, an ``example`` of a header.

    The quantities of one of the ``ways`` are required too, the first one preferred; a file may have only one of two
    ``opposed`` quantities. Columns of ``used`` are optional but must be readable if present. ``repeats`` is the meaning
    of repeated times. Kinds are equal by ``name``. Larger files than ``most_bytes`` are refused, and longer tables than
    ``most_rows``, if given. ``said`` are the user's statements on a file; ``known`` are titles (in lower case) of an
    instrument's format with their quantity and unit. ``prefix`` stands before a quantity in a user's statements on a
    file of this kind.
    """

    name: str
    quantities: Quantities = field(compare=False)
    required: tuple[str, ...] = field(compare=False)
    example: str = field(compare=False)
    ways: tuple[tuple[str, ...], ...] = field(default=((),), compare=False)
    opposed: tuple[tuple[str, str], ...] = field(default=(), compare=False)
    used: tuple[str, ...] = field(default=(), compare=False)
    repeats: str = field(default=REFUSED, compare=False)
    most_bytes: int = field(default=300_000_000, compare=False)
    most_rows: int | None = field(default=None, compare=False)
    said: Said = field(default=NOTHING, compare=False)
    known: Mapping[str, tuple[str, str]] = field(default_factory=dict, compare=False)
    prefix: str = field(default="", compare=False)

    def requiring(self, *quantities: str) -> Kind:
        """Return the same kind with other required columns."""
        return replace(self, required=quantities, ways=((),))

    def told(self, said: Said) -> Kind:
        """Return the same kind with a user's statements."""
        return replace(self, said=said)

    def knowing(self, known: Mapping[str, tuple[str, str]]) -> Kind:
        """Return the same kind with an instrument's titles."""
        return replace(self, known={**known, **self.known})

    def drawn(self, *quantities: str) -> Kind:
        """Return the same kind for a drawn waveform: only these columns are used, a repeated time is an edge."""
        return replace(self, required=quantities, ways=((),), used=(), repeats=EDGE)

    @property
    def whole(self) -> Kind:
        """The same kind after the part of a file has been chosen."""
        return replace(self, said=replace(self.said, part=None))

    @property
    def needed(self) -> tuple[str, ...]:
        """The quantities that are used if a column names them."""
        return tuple(dict.fromkeys((*self.required, *(q for way in self.ways for q in way), *self.used)))

    def way(self, readable: Collection[str]) -> tuple[str, ...]:
        """Return the first way that is ``readable`` completely, or else the one with the largest readable part."""
        return max(self.ways, key=lambda way: sum(q in readable for q in way) / max(len(way), 1))

    def complete(self, readable: Collection[str]) -> bool:
        """Return True if nothing required is missing."""
        return all(q in readable for q in (*self.required, *self.way(readable)))


#: quantity -> its Japanese, Chinese and Korean names.
_ASIAN = {
    "time": ("時間", "経過時間", "时间", "시간"),
    "voltage": ("電圧", "印加電圧", "電位", "電壓", "电压", "전압"),
    "current": ("電流", "电流", "전류"),
    "displacement": ("変位", "位移", "변위"),
    "frequency": ("周波数", "频率", "주파수"),
}

RECORD = Kind(
    "record",
    {
        "time": ("s", ("time", "t", "t_nominal", "zeit", "temps", "x_value", "elapsed", *_ASIAN["time"])),
        "voltage": (
            "V",
            (
                *("ewe-ece", "<ewe>", "ewe", "voltage", "potential", "u", "volt", "volts", "vf", "v", "e", "control"),
                *("working_electrode", "ecell", "spannung", "potenzial", "tension"),
                *_ASIAN["voltage"],
            ),
        ),
        "current": ("A", ("<i>", "current", "i", "im", "amps", "strom", "courant", *_ASIAN["current"])),
        "displacement": (
            "m",
            ("displacement", "deflection", "position", "tip", "weg", "auslenkung", *_ASIAN["displacement"]),
        ),
        "force": ("N", ("force", "kraft")),
        "charge": ("C", ("charge", "ladung")),
    },
    ("time", "voltage", "current"),
    "time_s, voltage_V, current_mA, displacement_mm, force_N",
    used=("voltage", "current", "displacement"),
)

_RE = (
    *("re(z)", "re", "z'", "z'(a)", "zre", "z_re", "zreal", "z_real", "re_z", "real", "real(z)", "z(re)", "real_part"),
    *("rs", "zr", "z1", "rez", "real_z", "real_impedance", "r"),
)
_IMAG = (
    *("im(z)", "im", "z''", "z''(b)", 'z"', "zim", "z_im", "zimag", "z_imag", "im_z", "imag", "imag(z)", "z(im)"),
    *("imaginary", "xs", "zi", "z2", "imz", "imag_z", "imaginary_z", "imaginary_impedance", "x"),
)
_IM = (*_IMAG, "imaginary_part")
_PHASE = ("phase(z)", "phase", "phase_angle", "zphz", "zphase", "z_phase", "arg(z)", "theta", "theta(z)", "phi")
_ANGULAR = ("angular_frequency", "omega", "\u03c9")
_MINUS = ("-", "minus_", "neg_", "negative_")
_RE_Y = ("re(y)", "y'", "yre", "y_re", "yreal", "conductance", "g")
_IM_Y = ("im(y)", "y''", "yim", "y_im", "yimag", "b")

SPECTRUM = Kind(
    "spectrum",
    {
        "frequency": ("Hz", ("frequency", "freq", "f", "frequenz", *_ANGULAR, *_ASIAN["frequency"])),
        "re": ("ohm", (*_RE, "resistance")),
        "minus_im": ("ohm", (*(f"{sign}{word}" for sign in _MINUS for word in _IM), "im(-z)")),
        "im": ("ohm", (*_IM, "reactance")),
        "modulus": ("ohm", ("|z|", "modulus", "zmod", "z_mod", "abs(z)", "mod(z)", "magnitude", "impedance", "z")),
        "minus_phase": ("deg", tuple(f"{sign}{word}" for sign in _MINUS for word in _PHASE)),
        "phase": ("deg", _PHASE),
        "re_y": ("S", _RE_Y),
        "minus_im_y": ("S", tuple(f"{sign}{word}" for sign in _MINUS for word in _IM_Y)),
        "im_y": ("S", (*_IM_Y, "susceptance")),
    },
    ("frequency",),
    "frequency_Hz, re_ohm, im_ohm",
    ways=(
        *(("re", "minus_im"), ("re", "im"), ("modulus", "minus_phase"), ("modulus", "phase")),
        *(("re_y", "minus_im_y"), ("re_y", "im_y")),
    ),
    opposed=(("im", "minus_im"), ("minus_phase", "phase"), ("minus_im_y", "im_y")),
    most_bytes=5_000_000,
    most_rows=20_000,
)

_SHORTENING = ("compressive_strain", "compression_strain", "stauchung")
_PRESSING = ("compressive_stress", "compression_stress", "druckspannung")
_STRETCHES = (("stretch",), ("compression",), ("strain",), ("true strain",), ("displacement",))

LOAD_TEST = Kind(
    "load test",
    {
        "stretch": ("", ("stretch", "stretch_ratio", "lambda")),
        # before "strain" and "stress", since these names end in the same words
        "true strain": ("", ("true_strain", "logarithmic_strain", "hencky_strain")),
        "compression": ("", _SHORTENING),
        "strain": ("", ("strain", "engineering_strain", "nominal_strain", "dehnung", "nominelle_dehnung")),
        "true stress": ("Pa", ("true_stress", "cauchy_stress")),
        "pressure": ("Pa", _PRESSING),
        "stress": ("Pa", ("stress", "spannung", "zugspannung")),
        "displacement": (
            "m",
            (
                *("displacement", "extension", "standard_travel", "standardweg", "crosshead", "traversenweg", "weg"),
                *("elongation", "stroke", "crosshead_travel"),
            ),
        ),
        "force": ("N", ("force", "load", "standard_force", "standardkraft", "kraft", "prüfkraft")),
    },
    (),
    "stretch, stress_MPa",
    ways=tuple((*way, stress) for way in _STRETCHES for stress in ("stress", "true stress", "pressure", "force")),
    opposed=(("stress", "true stress"),),
)

#: A displacement alone, from a camera or a laser: over time or frames, as a displacement or two coordinates.
TRACK = Kind(
    "track",
    {
        "time": RECORD.quantities["time"],
        "frame": ("", ("frame", "frames", "frame_number", "frame_no", "image", "bild", "bildnummer")),
        "displacement": RECORD.quantities["displacement"],
        "x": ("m", ("x", "x_position", "position_x", "pos_x", "center_x", "centroid_x", "tip_x")),
        "y": ("m", ("y", "y_position", "position_y", "pos_y", "center_y", "centroid_y", "tip_y")),
        "likelihood": ("", ("likelihood", "confidence")),
    },
    (),
    "time_s, displacement_mm, or time_s, x_px, y_px",
    ways=tuple((t, *way) for way in (("displacement",), ("x", "y"), ("x",), ("y",)) for t in ("time", "frame")),
    prefix=TRACK_PREFIX,
)

#: Number of lines in which the header of an export is searched.
PREAMBLE = 400
#: Largest number of characters in a row of names.
LONGEST_HEADER = 10_000

_FREQUENCY = re.compile(r"(?:^|[,;\t\"\s])(?:frequency|freq|f)\s*(?:_|\[|\(|/|,)\s*[kmMG]?Hz", re.IGNORECASE)
_ANGULAR_FREQUENCY = re.compile(r"(?:omega|angular[ _]frequency|\u03c9)\s*[_\[(/,]\s*rad", re.IGNORECASE)
_BARE_FREQUENCY = re.compile(r"(?:^|[,;\t\"\s])(?:frequency|freq)(?:[,;\t\"\s]|$)", re.IGNORECASE)
_OF_A_RECORD = re.compile(r"voltage|potential|(?:^|[,;\t])[ \"]{0,9}t(?:ime)?\s*[_/\[(]", re.IGNORECASE)
_REAL_PART = re.compile(
    r"(?:^|[^a-z])(?:z_?)?re(?:al)?(?:[^a-z]|$)|z['\u2019\u2032]|\|z\||phase|modulus|z_?mod", re.IGNORECASE
)


def frequency_row(lines: Sequence[str]) -> int | None:
    """Return the line (from 0) of column names that include a frequency, or None.

    A frequency without a unit counts only beside a real part.
    """
    for k, line in enumerate(lines[:PREAMBLE]):
        if len(line) >= LONGEST_HEADER:
            continue
        stated = _FREQUENCY.search(line) or _ANGULAR_FREQUENCY.search(line)
        if stated or (_BARE_FREQUENCY.search(line) and _REAL_PART.search(line)):
            return k
    return None


def names_a_record(header: str) -> bool:
    """Return True if the column names include a voltage or a time."""
    return bool(_OF_A_RECORD.search(header[:LONGEST_HEADER]))


def names_a_spectrum(header: str) -> bool:
    """Return True if column names with a frequency belong to a spectrum; a record may have a drive frequency."""
    return not names_a_record(header) or bool(_REAL_PART.search(header[:LONGEST_HEADER]))
