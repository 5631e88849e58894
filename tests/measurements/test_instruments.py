"""Files of instruments and of their programs: all hold one step, one spectrum, one load test, and are read to it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from format_texts import TEXTS
from instrument_texts import PULLS, SPECTRA, STEPS, Content, ivium, lvm, pssession, step, table, versastudio, xlsx
from record_texts import I, T, U
from spectrum_texts import F, Z
from track_texts import TRACKS

import ilg_circuit as ilg
from ilg_circuit import errors
from ilg_circuit.errors import InputError, MissingLibraryError
from ilg_circuit.measurements.formats import BINARIES, FORMATS
from ilg_circuit.measurements.kind import RECORD
from ilg_circuit.measurements.read import read, read_columns, read_load_test
from ilg_circuit.measurements.said import Said, said_of
from ilg_circuit.measurements.spectrum import Spectrum


def written(folder: Path, content: Content) -> Path:
    path = folder / "data.txt"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def require_step(path: Path, said: Said, rel: float = 1e-9) -> None:
    table = read_columns(path, RECORD.told(said))
    for quantity, values in (("time", T), ("voltage", U), ("current", I)):
        np.testing.assert_allclose(table.columns[quantity], values, rtol=rel, atol=1e-15, err_msg=quantity)


@pytest.mark.parametrize("name", STEPS)
def test_a_step(name: str, tmp_path: Path) -> None:
    path = written(tmp_path, STEPS[name]())
    require_step(path, Said(), 1e-6 if "mpr" in name else 1e-9)
    assert read(path).step == pytest.approx(1.5)  # type: ignore[union-attr]  # a record


@pytest.mark.parametrize("name", SPECTRA)
def test_a_spectrum(name: str, tmp_path: Path) -> None:
    found = read(written(tmp_path, SPECTRA[name]()))
    assert isinstance(found, Spectrum)
    rel = 1e-6 if "mpr" in name else 1e-9
    np.testing.assert_allclose(found.frequency, F[::-1], rtol=rel)
    np.testing.assert_allclose(found.impedance, Z[::-1], rtol=rel)


@pytest.mark.parametrize("name", PULLS)
def test_a_load_test(name: str, tmp_path: Path) -> None:
    path = written(tmp_path, PULLS[name]())
    test = read_load_test(path, "uniaxial")
    stretch = 1 + np.arange(1, 30) / 20
    np.testing.assert_allclose(test.stretch, stretch, rtol=1e-9)
    np.testing.assert_allclose(test.stress, 3.7e3 * np.arange(1, 30), rtol=1e-9)
    assert read(path, "uniaxial").stress.tolist() == test.stress.tolist()  # type: ignore[union-attr]


def test_there_are_many_and_every_format_is_among_them() -> None:
    names = [*{**TEXTS["record"], **STEPS}, *{**TEXTS["spectrum"], **SPECTRA}, *PULLS, *TRACKS]
    assert len(names) >= 60
    assert {f.NAME for f in (*FORMATS, *BINARIES)} <= set(names) | {name.split(",")[0] for name in names}
    assert len({name.split(",")[0] for name in names}) + len({n for n in names if n.startswith("CSV, ")}) >= 20


# -- several measurements in one file ----------------------------------------------------------------------------------

SEVERAL = {
    "VersaStudio": lambda: versastudio(parts=True),
    "LabVIEW": lambda: lvm(segments=3),
    "PalmSens session": lambda: pssession(count=2),
    "Ivium": lambda: ivium(count=2),
    "CSV": lambda: str(TEXTS["record"]["CSV"]()) * 2,
    "CSV, times begin again": lambda: TEXTS["record"]["CSV"]() + TEXTS["record"]["CSV"]().split("\n", 1)[1],
    "CSV, side by side": lambda: "first,,,second\ns,V,A,s,V,A\n" + table(step(0, 1, 2, 0, 1, 2)),
    "EC-Lab": lambda: TEXTS["record"]["EC-Lab"]() + TEXTS["record"]["EC-Lab, no preamble"]().split("\n", 1)[1],
}


@pytest.mark.parametrize("name", SEVERAL)
def test_several_measurements_are_listed_and_one_is_chosen(name: str, tmp_path: Path) -> None:
    path = written(tmp_path, SEVERAL[name]())
    with pytest.raises(InputError, match=r"data\.txt: holds [23] measurements: 1 \(.*; choose one with part=1"):
        read(path)
    first = read_columns(path, RECORD.told(Said(part=1)))
    assert first.time.tolist() == pytest.approx(T.tolist())
    assert len(read_columns(path, RECORD.told(Said(part=2))).time) == len(T)
    with pytest.raises(InputError, match=r"no part 9; it holds [23] measurements: 1 \("):
        read(path, said=Said(part=9))


def test_spectra_one_after_the_other(tmp_path: Path) -> None:
    text = TEXTS["spectrum"]["CSV"]()
    path = written(tmp_path, text + text.split("\n", 1)[1])
    with pytest.raises(InputError, match=r"holds 2 measurements: 1 \(lines 2 to 37\); 2 \(lines 38 to 73\)"):
        read(path)
    found = read(path, said=Said(part=2))
    assert isinstance(found, Spectrum)
    np.testing.assert_allclose(found.impedance, Z[::-1], rtol=1e-9)


def test_a_part_of_a_file_that_holds_one(tmp_path: Path) -> None:
    path = written(tmp_path, TEXTS["record"]["CSV"]())
    assert len(read_columns(path, RECORD.told(Said(part=1))).time) == len(T)
    with pytest.raises(InputError, match="no part 2; it holds 1 measurement: 1"):
        read(path, said=Said(part=2))


def test_a_cycle(tmp_path: Path) -> None:
    rows = "".join(
        f"{t:.12g},{u:.12g},{i:.12g},{1 + (k >= 100)}\n" for k, (t, u, i) in enumerate(zip(T, U, I, strict=True))
    )
    path = written(tmp_path, "time/s,Ewe/V,I/A,cycle number\n" + rows)
    assert read_columns(path, RECORD.told(Said(cycle=2))).time.tolist() == pytest.approx(T[100:].tolist())
    with pytest.raises(InputError, match="no cycle 3; column 'cycle number' holds 1 to 2"):
        read(path, said=Said(cycle=3))
    with pytest.raises(InputError, match="no column of cycles"):
        read(written(tmp_path, TEXTS["record"]["CSV"]()), said=Said(cycle=1))


def test_sheets_of_a_workbook(tmp_path: Path) -> None:
    rows = [("time_s", "voltage_V", "current_A"), *zip(T.tolist(), U.tolist(), I.tolist(), strict=True)]
    path = written(tmp_path, xlsx(("first", rows), ("second", rows)))
    with pytest.raises(InputError, match=r"holds 2 measurements: 1 \(first\); 2 \(second\)"):
        read(path)
    require_step(path, Said(part=2))


# -- what is said of a file --------------------------------------------------------------------------------------------

HEADERLESS = "".join(f"{t:.12g},{u:.12g},{i:.12g}\n" for t, u, i in zip(T, U, I, strict=True))


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("Clock,Bias,signal\n", {"time": "Clock", "voltage": "Bias", "current": "signal"}),
        ('Clock;Bias = set (V);my signal\'s "y"\n'.replace(";", "|"), {"time": "1", "voltage": "2", "current": "3"}),
        ("", {"time": "1", "voltage": "2", "current": "3"}),
        ("time,voltage,current\n", {}),
    ],
)
def test_columns_and_units_that_were_said(header: str, said: dict[str, str], tmp_path: Path) -> None:
    header = header.replace("|", ",")
    path = written(tmp_path, header + HEADERLESS)
    with pytest.raises(InputError, match="if so: "):
        read(path)
    require_step(path, said_of(said, {"time": "s", "voltage": "V", "current": "A"}))


@pytest.mark.parametrize(
    "header",
    ["Clock,Bias,signal", "time,voltage,current", "T [x],U [x],I [x]", "Tempo,Potenziale (V),Corrente (A)", "x,y,z"],
)
@pytest.mark.parametrize("above", ["", "An instrument, 2024\n\n"])
def test_the_options_of_a_refusal_work_as_they_stand(header: str, above: str, tmp_path: Path) -> None:
    """What the line says after "if so:" is pasted as a shell would split it."""
    import shlex

    path = written(tmp_path, above + header + "\n" + HEADERLESS)
    with pytest.raises(InputError) as caught, errors.written({"columns": "--columns", "units": "--units"}):
        read(path)
    message = str(caught.value)
    if "[x]" in header:
        assert "unit 'x'" in message
        return
    words = shlex.split(message.partition("if so: ")[2])
    assert set(words[::2]) <= {"--columns", "--units"}
    columns = [text for option, text in zip(words[::2], words[1::2], strict=True) if option == "--columns"]
    units = [text for option, text in zip(words[::2], words[1::2], strict=True) if option == "--units"]
    require_step(path, said_of(columns, units))


def test_a_shunt(tmp_path: Path) -> None:
    """Two channels in volts, the second across 10 ohm: 0.1 A to one of the file."""
    rows = "".join(f"{t:.12g},{u:.12g},{10 * i:.12g}\n" for t, u, i in zip(T, U, I, strict=True))
    path = written(tmp_path, "x-axis,1,2\nsecond,Volt,Volt\n" + rows)
    said = "both give the voltage; .* columns={'voltage': '1', 'current': '2'}, units={'current': 'A'}"
    with pytest.raises(InputError, match=said):
        read(path)
    require_step(path, said_of(["voltage=1", "current=2"], ["current=0.1A"]))


def test_channels_named_by_letters_are_no_units(tmp_path: Path) -> None:
    path = written(tmp_path, "Time,Ch A,Ch B\n(s),(V),(V)\n" + HEADERLESS)
    with pytest.raises(InputError, match="columns 'Ch A' and 'Ch B' both give the voltage"):
        read(path)


@pytest.mark.parametrize("title", ["Time(h:min:s.ms)", "Timestamp", "Clock"])
def test_times_of_a_clock(title: str, tmp_path: Path) -> None:
    rows = "".join(f"0:00:{t:06.3f},{u:.12g},{i:.12g}\n" for t, u, i in zip(T, U, I, strict=True))
    path = written(tmp_path, f"{title},Voltage (V),Current (A)\n" + rows)
    require_step(path, Said() if "(" in title else said_of([f"time={title}"], ["time=s"]))


def test_columns_in_memory_are_said_too() -> None:
    data = {"Clock": T, "U (V)": U, "signal": I * 1e3}
    found = ilg.read(data, columns={"time": "Clock", "current": "signal"}, units={"time": "s", "current": "mA"})
    assert found.current.values.max() == pytest.approx(I.max())
    with pytest.raises(InputError, match=r"if so: columns={'time': 'Clock', 'current': 'signal'}, units={'time': 's'"):
        ilg.read(data)
    with pytest.raises(InputError, match="part and cycle choose in files"):
        ilg.read(data, part=2)


@pytest.mark.parametrize(
    ("columns", "units", "said"),
    [
        (["volt=x"], [], "quantities are time, voltage"),
        (["voltage"], [], "write it like voltage='Potential"),
        (["voltage=a", "voltage=b"], [], "voltage is given twice"),
        (["voltage=none"], [], "there is no column 'none'; the file has 'time_ms', 'voltage \\[mV\\]'"),
        ([], ["time=m"], "unit 'm' does not measure"),
        ([], ["time=0A"], "unit 'A'"),
    ],
)
def test_what_cannot_be_said_is_one_line(columns: list[str], units: list[str], said: str, tmp_path: Path) -> None:
    path = written(tmp_path, TEXTS["record"]["CSV"]())
    with pytest.raises(InputError, match=said) as caught:
        read(path, said=said_of(columns, units))
    assert "\n" not in str(caught.value)


def test_imaginary_parts_of_either_sign_can_be_said(tmp_path: Path) -> None:
    rows = "".join(f"{f!r},{z.real!r},{-z.imag!r}\n" for f, z in zip(F.tolist(), Z.tolist(), strict=True))
    path = written(tmp_path, "frequency_Hz,re_ohm,im_ohm\n" + rows)
    with pytest.raises(InputError, match=r"columns={'minus_im': 'im_ohm'}"):
        read(path)
    found = read(path, said=said_of(["minus_im=im_ohm"]))
    assert isinstance(found, Spectrum)
    np.testing.assert_allclose(found.impedance, Z[::-1], rtol=1e-9)


# -- what is refused ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Excel", "EC-Lab mpr"])
def test_a_missing_reader_is_named(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, STEPS[name]())
    monkeypatch.setattr("ilg_circuit.extras.find_spec", lambda module: None)
    with pytest.raises(MissingLibraryError, match=r"data\.txt: .* needs (openpyxl|galvani): .*ilg-circuit\[formats\]"):
        read(path)


@pytest.mark.parametrize("name", sorted({*STEPS} & {"Excel", "EC-Lab mpr", "Ivium", "VersaStudio", "LabVIEW"}))
def test_damaged_files_are_read_or_refused_in_one_line(name: str, tmp_path: Path) -> None:
    content = STEPS[name]()
    good = content if isinstance(content, bytes) else content.encode()
    random = np.random.default_rng(3)
    for _ in range(25):
        bad = bytearray(good)
        for place in random.integers(len(bad), size=5):
            bad[place] = int(random.integers(256))
        raw = bytes(bad[: int(random.integers(len(bad) // 2, len(bad)))]) if random.random() < 0.5 else bytes(bad)
        said = ""
        try:
            table = read_columns(written(tmp_path, raw), RECORD)
            assert (np.diff(table.time) > 0).all()
        except InputError as error:
            said = str(error)
        assert "\n" not in said
        assert len(said) < 1500


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("force", "give the specimen's undeformed section with section="),
        ("extension", "free length with length='20mm'"),
    ],
)
def test_sizes_of_a_specimen(name: str, said: str, tmp_path: Path) -> None:
    title = "extension (mm),stress (Pa)" if name == "extension" else "strain,force (N)"
    rows = "".join(
        f"{k / 20 * (40 if name == 'extension' else 1)},{k * (3.7e3 if name == 'extension' else 0.0185)}\n"
        for k in range(30)
    )
    path = written(tmp_path, title + "\n" + rows)
    with pytest.raises(InputError, match=said):
        read_load_test(path, "uniaxial")
    test = read_load_test(path, "uniaxial", said_of(length=0.04, section=5e-6))
    np.testing.assert_allclose(test.stress, 3.7e3 * np.arange(1, 30), rtol=1e-9)
    np.testing.assert_allclose(test.stretch, 1 + np.arange(1, 30) / 20, rtol=1e-9)
