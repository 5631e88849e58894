"""What a measured file may hold: a record over time, an impedance spectrum, a load test; their columns and limits."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from .said import NOTHING, TRACK_PREFIX, Said

#: quantity -> (SI unit, "" for a pure number; words that a column's name may be or end in, the first one preferred)
Quantities = dict[str, tuple[str, tuple[str, ...]]]

#: What rows at one time are: a mistake, an instrument's two readings of which the later stays, the edge of a drive.
REFUSED, LATER, EDGE = "refused", "later", "edge"


@dataclass(frozen=True)
class Kind:
    """One kind of data: the ``quantities`` its columns may hold, those ``required``, an ``example`` of a header.

    Of ``ways`` the quantities of one are required too, the first one preferred; of two ``opposed`` ones a file has one.
    Columns of ``used`` are not required, but where one is there it must be readable. ``repeats`` says what rows at one
    time are. Kinds are equal by ``name``. Files are refused above ``most_bytes``, and above ``most_rows`` where that is
    given. ``said`` is what a user says of a file; ``known`` what an instrument's format does: the quantity and the unit
    of titles in lower case. ``prefix`` stands before a quantity where a user says something of a file of this kind.
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
        """Return the same kind of which a user says something."""
        return replace(self, said=said)

    def knowing(self, known: Mapping[str, tuple[str, str]]) -> Kind:
        """Return the same kind in the words of an instrument."""
        return replace(self, known={**known, **self.known})

    def drawn(self, *quantities: str) -> Kind:
        """Return the same kind as a drawn waveform has it: these columns alone matter, a time that stands twice is an
        edge.
        """
        return replace(self, required=quantities, ways=((),), used=(), repeats=EDGE)

    @property
    def whole(self) -> Kind:
        """The same kind, of which the part of a file that was meant is chosen already."""
        return replace(self, said=replace(self.said, part=None))

    @property
    def needed(self) -> tuple[str, ...]:
        """The quantities that matter where a column names them."""
        return tuple(dict.fromkeys((*self.required, *(q for way in self.ways for q in way), *self.used)))

    def way(self, readable: Collection[str]) -> tuple[str, ...]:
        """Return the first way all of which is ``readable``, or else the one of which the largest part is."""
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
_MINUS = ("-", "minus_", "neg_", "negative_")
_RE_Y, _IM_Y = ("re(y)", "y'", "yre", "y_re", "yreal", "conductance"), ("im(y)", "y''", "yim", "y_im", "yimag")

SPECTRUM = Kind(
    "spectrum",
    {
        "frequency": ("Hz", ("frequency", "freq", "f", "frequenz", *_ASIAN["frequency"])),
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
        # before "strain" and "stress": their names end in those words too
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

#: A displacement alone, as a camera or a laser writes it: over time or frames, as it is or by two coordinates.
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
#: No row of names is longer.
LONGEST_HEADER = 10_000

_FREQUENCY = re.compile(r"(?:^|[,;\t\"\s])(?:frequency|freq|f)\s*(?:_|\[|\(|/|,)\s*[kmMG]?Hz", re.IGNORECASE)
_BARE_FREQUENCY = re.compile(r"(?:^|[,;\t\"\s])(?:frequency|freq)(?:[,;\t\"\s]|$)", re.IGNORECASE)
_OF_A_RECORD = re.compile(r"voltage|potential|(?:^|[,;\t])[ \"]{0,9}t(?:ime)?\s*[_/\[(]", re.IGNORECASE)
_REAL_PART = re.compile(
    r"(?:^|[^a-z])(?:z_?)?re(?:al)?(?:[^a-z]|$)|z['\u2019\u2032]|\|z\||phase|modulus|z_?mod", re.IGNORECASE
)


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
    """Return True if names of columns have a voltage or a time among them."""
    return bool(_OF_A_RECORD.search(header[:LONGEST_HEADER]))


def names_a_spectrum(header: str) -> bool:
    """Return True if columns, one a frequency, are those of a spectrum: a record may have the drive's frequency."""
    return not names_a_record(header) or bool(_REAL_PART.search(header[:LONGEST_HEADER]))
