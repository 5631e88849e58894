"""What holds for every registered format: its examples are recognised and read, damaged ones end in one line."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from damage import read_or_refused
from format_texts import PAIRS, TEXTS, examples, load_test
from track_texts import track_said

from ilg_circuit.errors import InputError
from ilg_circuit.identification.kramers_kronig import kramers_kronig
from ilg_circuit.measurements.formats import FORMATS, Format
from ilg_circuit.measurements.kind import LOAD_TEST, RECORD, SPECTRUM, TRACK, Kind
from ilg_circuit.measurements.load_test import LoadTest
from ilg_circuit.measurements.read import read, read_load_test, read_record, read_spectrum
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.measurements.track import read_track

each = pytest.mark.parametrize(("format_", "kind"), PAIRS, ids=[f"{f.NAME}-{kind.name}" for f, kind in PAIRS])


def test_names_differ_and_every_example_is_of_a_registered_format() -> None:
    names = [f.NAME for f in FORMATS]
    assert len(set(names)) == len(names)
    assert sum(len(examples(*pair)) for pair in PAIRS) == sum(map(len, TEXTS.values()))


@each
def test_its_examples_are_recognised_by_it_alone_or_first(format_: Format, kind: Kind) -> None:
    assert examples(format_, kind), f"an example of a {kind.name} in the format {format_.NAME} belongs in the tests"
    for name, text in examples(format_, kind).items():
        lines = text().lstrip("\ufeff").splitlines()
        first = next(f for f in FORMATS if f.recognises(lines) is not None)
        assert (first.NAME, first.recognises(lines)) == (format_.NAME, kind), name
        meant = kind.told(track_said(name)) if kind == TRACK else kind
        assert kind.complete(format_.read(lines, "s.txt", meant).columns) or kind == SPECTRUM, name


@each
def test_it_recognises_neither_nothing_nor_prose(format_: Format, kind: Kind) -> None:
    for lines in ([], [""], ["Dear reader,", "this is a letter."]):
        assert format_.recognises(lines) is None or format_ is FORMATS[-1]


def check(measured: Record | Spectrum | LoadTest) -> None:
    if isinstance(measured, Record):
        assert np.isfinite(measured.current.values).all()
        assert (np.diff(measured.current.time) > 0).all()
    elif isinstance(measured, Spectrum):
        assert np.isfinite(measured.impedance).all()
        assert (np.diff(measured.frequency) > 0).all()
        kramers_kronig(measured)
    else:
        assert np.isfinite(measured.stress).all()
        assert (measured.stretch > 0).all()


@each
def test_damaged_files_end_in_data_or_one_line(format_: Format, kind: Kind, tmp_path: Path) -> None:
    """Warnings are errors here, so an overflow on the way counts as a failure too."""
    readers: dict[str, Callable[[Path], Record | Spectrum | LoadTest]] = {
        RECORD.name: read_record,
        SPECTRUM.name: read_spectrum,
        LOAD_TEST.name: lambda path: read_load_test(path, "uniaxial"),
    }

    if kind == TRACK:
        for name, text in examples(format_, kind).items():
            track = partial(read_track, said=track_said(name))
            outcomes = read_or_refused(tmp_path / "s.txt", range(20), {name: text}, track)
            assert len(outcomes) > 1, outcomes
        return
    for reader in (readers[kind.name], lambda path: read(path, "uniaxial")):
        outcomes = read_or_refused(
            tmp_path / "s.txt", range(60), examples(format_, kind), lambda path, reader=reader: check(reader(path))
        )
        assert min(outcomes.values()) > 1, outcomes


def test_a_load_test_needs_its_mode(tmp_path: Path) -> None:
    path = tmp_path / "pulled.csv"
    path.write_text(load_test())
    with pytest.raises(InputError, match=r"pulled\.csv: holds a load test, .* uniaxial, equibiaxial, planar"):
        read(path)
    test = read(path, "planar")
    assert isinstance(test, LoadTest)
    assert test.mode == "planar"
    assert test.stress.tolist() == read_load_test(path, "planar").stress.tolist()


def test_a_file_too_large_for_a_spectrum_is_read_as_a_record(tmp_path: Path) -> None:
    """So a long record that has columns of an impedance too stays one."""
    path = tmp_path / "long.txt"
    header = "time/s\tfreq/Hz\tRe(Z)/Ohm\tEwe/V\t<I>/mA"
    t = np.arange(0.0, 100.0, 0.01)
    rows = [f"{x}\t0\t0\t1.5\t{2 + np.exp(-x / 5)}" for x in t.tolist()]
    path.write_text("\n".join([header, *rows]))
    with pytest.raises(InputError, match="imaginary part"):
        read(path)
    path.write_text("\n".join(["#" * 5_000_000, header, *rows]))
    assert isinstance(read(path), Record)
