"""An example of every kind of data in every format that is read, as text."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import instrument_texts
import record_texts
import spectrum_texts
from track_texts import TRACKS

from ilg_circuit.measurements.formats import BINARIES, FORMATS, Format
from ilg_circuit.measurements.kind import LOAD_TEST, RECORD, SPECTRUM, TRACK, Kind
from ilg_circuit.measurements.text import decoded

Texts = dict[str, Callable[[], str]]


def load_test() -> str:
    return "stretch,stress_kPa\n" + "".join(f"{1 + k / 20},{k * 3.7}\n" for k in range(30))


def text_of(file: Callable[[], str | bytes]) -> str:
    content = file()
    return decoded(content) if isinstance(content, bytes) else content


def texts(files: dict[str, Callable[[], str | bytes]]) -> Texts:
    """Return those of files that are text, in whatever encoding."""
    binaries = {binary.NAME for binary in BINARIES}
    return {name: partial(text_of, file) for name, file in files.items() if name.split(",")[0] not in binaries}


#: name of a kind -> "format" or "format, variant" -> text
TEXTS: dict[str, Texts] = {
    RECORD.name: {**record_texts.FORMATS, **texts(instrument_texts.STEPS)},
    SPECTRUM.name: {**spectrum_texts.FORMATS, **texts(instrument_texts.SPECTRA)},
    LOAD_TEST.name: {"CSV": load_test},
    TRACK.name: {name: text for name, (text, _) in TRACKS.items() if not name.startswith("CSV")},
}

#: Every format with every kind of data that its files may hold.
PAIRS: tuple[tuple[Format, Kind], ...] = tuple(
    (f, kind) for f in FORMATS for kind in f.KINDS if kind != TRACK or f is not FORMATS[-1]
)


def examples(format_: Format, kind: Kind) -> Texts:
    """Return the texts of one format that hold one kind of data."""
    return {name: text for name, text in TEXTS[kind.name].items() if name.split(",")[0] == format_.NAME}
