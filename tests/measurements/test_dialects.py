"""One record in the dialects of many instruments and spreadsheets: each is read to the same values."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ilg_circuit.errors import InputError
from ilg_circuit.measurements.kind import RECORD
from ilg_circuit.measurements.read import read, read_columns
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum

_RANDOM = np.random.default_rng(7)
T = np.round(np.arange(0.0, 20.0, 0.25), 6)
U = np.where(T >= 5, 4.0, 0.0)
I = np.round(np.where(T >= 5, 6e-3 + 0.2 * np.exp(-(T - 5) / 7), 0.0) + 1e-4 * _RANDOM.normal(size=len(T)), 9)  # noqa: E741

PREAMBLE = "Instrument: SMU 2450, serial 04030301\nDate, 2024-03-01, 12:00:00\nOperator: N, N\n\n"


def rows(
    separator: str = ",",
    scale: Sequence[float] = (1, 1, 1),
    comma: bool = False,
    written: Callable[..., list[str]] = lambda t, u, i, k: [t, u, i],
) -> str:
    """The rows; ``written`` makes the cells of row k from the numbers as text."""
    a, b, c = scale
    lines = []
    for k, (t, u, i) in enumerate(zip(T, U, I, strict=True)):
        cells = [f"{x:.12g}" for x in (t * a, u * b, i * c)]
        cells = [cell.replace(".", ",") for cell in cells] if comma else cells
        lines.append(separator.join(written(*cells, k)))
    return "\n".join(lines) + "\n"


MILLI = (1, 1, 1e3)

DIALECTS: dict[str, str | bytes] = {
    "EC-Lab's names, commas": "time/s,Ewe/V,<I>/mA\n" + rows(scale=MILLI),
    "EC-Lab's names, semicolons, decimal commas": "time/s;Ewe/V;I/mA\n" + rows(";", MILLI, comma=True),
    "EC-Lab's names, tabs": "time/s\tEwe/V\t<I>/mA\n" + rows("\t", MILLI),
    "EC-Lab's set and measured voltage": "time/s,control/V,Ewe/V,<I>/mA\n"
    + rows(scale=MILLI, written=lambda t, u, i, k: [t, "9", u, i]),
    "Nova": "Time (s);Corrected time (s);WE(1).Potential (V);WE(1).Current (A);Index\n"
    + rows(";", written=lambda t, u, i, k: [t, f"{k}", u, i, "1"]),
    "Nova, the corrected time first": "Corrected time (s);Time (s);WE(1).Potential (V);WE(1).Current (A)\n"
    + rows(";", written=lambda t, u, i, k: [f"{k}", t, u, i]),
    "KickStart": '"Keithley Instruments","2450","04030301"\n\n\n'
    "Index,Relative Time (s),Source Value (V),Measure Value (A)\n" + rows(written=lambda t, u, i, k: [f"{k}", t, u, i]),
    "KickStart, words in quotes": PREAMBLE
    + '"Relative Time (s)","Source Value (V)","Measure Value (A)"\n'
    + rows(written=lambda *c: [f'"{x}"' for x in c[:3]]),
    "CHI": "Mar. 1, 2024   12:00:00\nChronoamperometry\nInstrument Model:  CHI660E\n\n"
    "Time/sec, Potential/V, Current/A\n\n" + rows(", "),
    "PalmSens, UTF-16": (
        "Date and time:,2024-03-01 12:00:00\nNotes:\n\nChronoamperometry: CA\ns,V,\u00b5A\n" + rows(scale=(1, 1, 1e6))
    ).encode("utf-16"),
    "spreadsheet, sep=": "sep=;\ntime_s;voltage_V;current_mA\n" + rows(";", MILLI, comma=True),
    "spreadsheet, filled up with separators": "time_s,voltage_V,current_A,,\n,,,,\n"
    + rows(written=lambda t, u, i, k: [t, u, i, "", ""])
    + ",,,,\n,,,,\n",
    "units in a row": "Time,Voltage,Current\ns,V,mA\n" + rows(scale=MILLI),
    "units in a row, in brackets": "Time\tVoltage\tCurrent\n(s)\t(V)\t(mA)\n" + rows("\t", MILLI),
    "units in a row, remarks below": PREAMBLE
    + "Time;Potential;Current\nms;mV;uA\nrun 1;set;CH1\n"
    + rows(";", (1e3, 1e3, 1e6)),
    "units only": "s;V;mA\n" + rows(";", MILLI),
    "units written out": "Time (Seconds),Voltage (Volts),Current (milliAmps)\n" + rows(scale=MILLI),
    "commas before units": "Time, s;Voltage, V;Current, mA\n" + rows(";", MILLI),
    "a space before units": "Time s;Voltage V;Current mA\n" + rows(";", MILLI),
    "CorrWare": "E(Volts),I(Amps),T(Seconds)\n" + rows(written=lambda t, u, i, k: [u, i, t]),
    "reference electrode": "Time/s,E (V vs. Ag/AgCl),Current/mA\n" + rows(scale=MILLI),
    "reference electrode behind": "Time (s),Potential (V) vs. SHE,Current (mA)\n" + rows(scale=MILLI),
    "names of channels": "SMU1.Time (s),SMU1:Voltage (V),CH1 Current (A)\n" + rows(),
    "set and measured": "Time (s),Set Voltage (V),Measured Voltage (V),Measured Current (A)\n"
    + rows(written=lambda t, u, i, k: [t, "7", u, i]),
    "cycler": "Data_Point,Date_Time,Test_Time(s),Step_Time(s),Step_Index,Current(A),Voltage(V)\n"
    + rows(written=lambda t, u, i, k: [f"{k}", "2024-03-01 12:00:00", t, f"{k % 9}", "1", i, u]),
    "numpy.savetxt": "# time_s,voltage_V,current_A\n" + rows(),
    "numpy.savetxt, spaces": "# time_s voltage_V current_A\n" + rows(" "),
    "percent signs": "% recorded today\n% Time (s), Voltage (V), Current (A)\n" + rows(),
    "spaces, decimal commas": "time_s voltage_V current_A\n" + rows("   ", comma=True),
    "aligned columns": "  Time (s)    Voltage (V)    Current (mA)\n" + rows("      ", MILLI),
    "single spaces": "Time (s) Voltage (V) Current (mA)\n" + rows(" ", MILLI),
    "text with as many commas": "a, b, c\nGain, x1, x10\n" * 3 + "time_s,voltage_V,current_A\n" + rows(),
    "settings that look like names": "Start time (s),0\nMax voltage (V),10\nMax current (A),0.5\n"
    "time_s,voltage_V,current_A\n" + rows(),
    "text below": "time_s,voltage_V,current_A\n" + rows() + "\nEnd of data\nNumber of points: 80\n",
    "text below with as many commas": "time_s,voltage_V,current_A\n" + rows() + "mean,3.0,0.05\nEnd,of,data\n",
    "a column of text": "time_s,remark,voltage_V,current_A\n"
    + rows(written=lambda t, u, i, k: [t, "o_k, it is" * 0, u, i]),
    "line ends of Windows, mark of UTF-8": ("\ufefftime_s,voltage_V,current_A\n" + rows()).replace("\n", "\r\n"),
    "line ends of an old Mac": (PREAMBLE + "time_s,voltage_V,current_A\n" + rows()).replace("\n", "\r"),
    "Latin-1": (PREAMBLE + "Zeit \u00e4\ntime_s;voltage_V;current_\u00b5A\n" + rows(";", (1, 1, 1e6))).encode(
        "latin-1"
    ),
    "UTF-8 read as Latin-1": "time_s,voltage_V,current_\u00c2\u00b5A\n" + rows(scale=(1, 1, 1e6)),
    "UTF-16 without a mark": ("time_s,voltage_V,current_A\n" + rows()).encode("utf-16-le"),
    "units after in": "t in s;U in V;I in mA\n" + rows(";", MILLI),
    "one time in two units": "Time/s,Time/h,Ewe/V,I/mA\n"
    + rows(scale=MILLI, written=lambda t, u, i, k: [t, f"{k}", u, i]),
    "UTF-8 mark before Latin-1": b"\xef\xbb\xbf"
    + ("time_s;voltage_V;current_\u00b5A\n" + rows(";", (1, 1, 1e6))).encode("latin-1"),
    "typographic minus": "time_s,voltage_V,current_A\n" + rows().replace("-", "\u2212"),
    "end of a DOS file": "time_s,voltage_V,current_A\n" + rows() + "\x1a",
    "strokes and a date below": "time_s,voltage_V,current_A\n"
    + rows()
    + "-----\n*** END ***\n2024-03-01 12:00:00\n80 points\n",
    "siemens for seconds": "Time(S),Voltage(V),Current(A)\n" + rows(),
    "a density beside the current": "Time/s,Voltage/V,Current density/mA cm-2,Current/mA,J/mA cm^-2\n"
    + rows(scale=MILLI, written=lambda t, u, i, k: [t, u, "1", i, "2"]),
}


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("name", DIALECTS)
def test_every_dialect_is_the_same_record(name: str, tmp_path: Path) -> None:
    path = write(tmp_path / "record.txt", DIALECTS[name])
    table = read_columns(path, RECORD)
    assert table.time == pytest.approx(T, rel=1e-9, abs=1e-12)
    assert table.columns["voltage"] == pytest.approx(U, rel=1e-9, abs=1e-12)
    assert table.columns["current"] == pytest.approx(I, rel=1e-9, abs=1e-15)
    assert set(table.headers) == {"time", "voltage", "current"}
    found = read(path)
    assert isinstance(found, Record)
    between = (4.75, 5.0)  # the last reading at rest, the first one at the level
    assert (found.onset, found.step) == (sum(between) / 2, pytest.approx(4.0))
    assert found.current.bracket == (-0.125, 0.125)
    assert found.headers == table.headers


# -- readings that are none --------------------------------------------------------------------------------------------

MARKS = "9.91E+37 -9.9e37 +9.90000E+37 3.4028235e38 1.7976931348623157e308 1e999 inf -Inf Infinity NaN -nan OVL ovld "
MARKS += "OL O.L -- ---.-- ***** #N/A n/a NULL OverRange Overload 1.#QNAN -1.#IND 1.#INF00 #NUM! ?"


@pytest.mark.parametrize("mark", MARKS.split())
@pytest.mark.parametrize("separator", [",", ";"])
def test_marks_for_no_reading_are_gaps_and_told(mark: str, separator: str, tmp_path: Path) -> None:
    text = f"time_s{separator}voltage_V{separator}current_A\n"
    text += rows(separator, written=lambda t, u, i, k: [t, u, mark if k in (20, 21, 40) else "" if k == 50 else i])
    table = read_columns(write(tmp_path / "record.csv", text), RECORD)
    gaps = np.flatnonzero(np.isnan(table.columns["current"]))
    assert gaps.tolist() == [20, 21, 40, 50]
    assert np.delete(table.columns["current"], gaps) == pytest.approx(np.delete(I, gaps), rel=1e-9)
    (note,) = table.notes
    assert (note.code, note.values) == ("readings-marked", {"quantity": "current", "count": 3, "mark": mark})
    assert mark in str(note)


def test_a_time_without_a_reading_is_refused(tmp_path: Path) -> None:
    text = "time_s,voltage_V,current_A\n" + rows(written=lambda t, u, i, k: ["OVL" if k == 9 else t, u, i])
    with pytest.raises(InputError, match="line 11 has no time"):
        read_columns(write(tmp_path / "record.csv", text), RECORD)


# -- what is refused ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("freq,Zreal,Zimag", "column 'freq' has no unit; write it like 'freq_Hz'"),
        ("freq_Hz,Zreal,Zimag", "column 'Zreal' has no unit; write it like 'Zreal_ohm'"),
        ("freq_Hz,Zreal_ohm,Zimag", "column 'Zimag' has no unit; write it like 'Zimag_ohm'"),
        ("Time,Voltage (V),Current (A)", "column 'Time' has no unit; write it like 'Time_s'"),
        ("time/s,Ewe/V,<I>/mA/cm2", "column '<I>/mA/cm2': unit 'mA/cm2' is one per area; multiply by the electrode's"),
        ("time_s,voltage_V,current_px", "column 'current_px': unit 'px' needs a scale"),
        ("time_s,voltage_V,current_au", "column 'current_au': unit 'au' needs a scale"),
        ("time_s,voltage_V,U_V,current_A", "columns 'voltage_V' and 'U_V' both give the voltage; leave one out"),
        ("time_s,voltage_V,volume_l", "no column for current; not understood: 'volume_l'"),
    ],
)
@pytest.mark.parametrize("above", ["", PREAMBLE])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_headers_that_lack_something_are_one_line(
    header: str, said: str, above: str, separator: str, tmp_path: Path
) -> None:
    width = header.count(",") + 1
    body = "".join(separator.join([f"{k + 1}", *["1"] * (width - 1)]) + "\n" for k in range(30))
    path = write(tmp_path / "record.csv", above + header.replace(",", separator) + "\n" + body)
    with pytest.raises(InputError) as caught:
        read(path)
    assert said in str(caught.value)
    assert str(caught.value).startswith("record.csv: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("unit", ["pt", "pica", "didot", "counts", "a.u.", "au", "parsec", "frames"])
def test_a_displacement_in_no_length_is_refused_and_other_columns_are_not(unit: str, tmp_path: Path) -> None:
    body = rows(written=lambda t, u, i, k: [t, u, i, "1"])
    path = write(tmp_path / "record.csv", f"time_s,voltage_V,current_A,displacement_{unit}\n{body}")
    with pytest.raises(InputError, match=f"column 'displacement_{re.escape(unit)}': unit '{re.escape(unit)}'"):
        read(path)
    write(path, f"time_s,voltage_V,current_A,force_{unit}\n{body}")
    assert read_columns(path, RECORD).ignored == (f"force_{unit}",)


@pytest.mark.parametrize("row", ["12,x,1", "oops", "1e,4,0.1", "time_s,voltage_V,current_mA"])
def test_text_between_the_rows_is_refused(row: str, tmp_path: Path) -> None:
    lines = ("time_s,voltage_V,current_A\n" + rows()).splitlines()
    for at in (1, 40):
        path = write(tmp_path / "record.csv", "\n".join([*lines[:at], row, *lines[at:]]))
        if at == 40 or row.startswith("1"):
            with pytest.raises(InputError, match=f"line {at + 1}, column '.*' is not a number"):
                read_columns(path, RECORD)
        else:
            assert len(read_columns(path, RECORD).time) == len(T)


# -- laws --------------------------------------------------------------------------------------------------------------

WORDS = st.text("abcdefghijklm XYZ:(),;=\t/\"'", max_size=40)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(above=st.lists(WORDS, max_size=6), below=st.lists(st.text("abcdefg ,:", min_size=1, max_size=20), max_size=3))
def test_lines_of_words_above_and_below_change_nothing(above: list[str], below: list[str], tmp_path: Path) -> None:
    text = "\n".join([*above, "time_s,voltage_V,current_A\n"]) + rows() + "".join(f"z{line}\n" for line in below)
    table = read_columns(write(tmp_path / "record.csv", text), RECORD)
    assert table.time.tolist() == T.tolist()
    assert table.columns["current"].tolist() == pytest.approx(I.tolist(), rel=1e-12)
    assert [n.values["count"] for n in table.notes if n.code == "lines-below"] == [len(below)] * bool(below)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(
    values=st.lists(st.tuples(*[st.one_of(st.floats(-1e6, 1e6), st.none())] * 2), min_size=1, max_size=30),
    separator=st.sampled_from([",", ";", "\t"]),
    comma=st.booleans(),
    quoted=st.booleans(),
)
def test_both_ways_of_reading_give_the_same_numbers(
    values: list[tuple[float | None, float | None]], separator: str, comma: bool, quoted: bool, tmp_path: Path
) -> None:
    """Quotation marks turn numpy's reader off; the numbers are those that were written, bit for bit."""
    lines = [separator.join(("time_s", "voltage_V", "current_A"))]
    for k, pair in enumerate(values):
        cells = [str(k), *("" if x is None else repr(x) for x in pair)]
        cells = [c.replace(".", ",") for c in cells] if comma and separator != "," else cells
        lines.append(separator.join(f'"{c}"' for c in cells) if quoted else separator.join(cells))
    table = read_columns(write(tmp_path / "record.csv", "\n".join(lines)), RECORD)
    for j, name in enumerate(("voltage", "current")):
        expected = [np.nan if pair[j] is None else pair[j] for pair in values]
        np.testing.assert_array_equal(table.columns[name], np.array(expected, dtype=float))


# -- spectra -----------------------------------------------------------------------------------------------------------

F = np.geomspace(1e3, 0.1, 20)
Z = 20 + 600 / (1 + 2j * np.pi * F * 10)

SPECTRA = {
    "EZStat": "Frequency (Hz),|Z| (Ohm),Phase (deg),Re(Z) (Ohm),-Im(Z) (Ohm)",
    "EC-Lab of today": "freq/Hz,Re(M),Im(M),Re(Z)/Ohm,-Im(Z)/Ohm,|Z|/Ohm,Phase(Z)/deg,Re(Y)/Ohm-1,Im(Y)/Ohm-1,Re(C)/nF",
    "EC-Lab, three electrodes": "freq/Hz,Re(Zce)/Ohm,-Im(Zce)/Ohm,Re(Zwe-ce)/Ohm,-Im(Zwe-ce)/Ohm,Re(Z)/Ohm,-Im(Z)/Ohm",
    "Nova": "Index,Frequency (Hz),Z' (\u03a9),-Z'' (\u03a9),Z (\u03a9),-Phase (\u00b0),Time (s)",
    "PalmSens": "freq / Hz,neg. Phase / \u00b0,Idc / uA,Z / Ohm,Z' / Ohm,-Z'' / Ohm,Cs / F",
    "primes": "Frequency [Hz],Z\u2032 [k\u03a9],\u2212Z\u2033 [k\u03a9]",
    "words": "Freq (Hz),Z real (Ohms),-Z imag (Ohms)",
    "LCR meter": "freq_Hz,resistance_ohm,reactance_mohm",
    "nothing but brackets": "f(Hz),Re(Ohm),-Im(Ohm)",
}


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("name", SPECTRA)
def test_names_of_spectra(name: str, separator: str, tmp_path: Path) -> None:
    titles = SPECTRA[name].split(",")

    def cell(title: str, f: float, z: complex) -> str:
        plain = title.replace("\u2212", "-").replace("\u2033", "''").replace("\u2032", "'").lower()
        unit = 1e-3 if "k\u03a9" in title else 1e3 if "mohm" in title else 1.0
        if plain.startswith("f"):
            return repr(f)
        if re.match(r"(-?im(\(z\)|\(ohm)|-z''|-z imag|reactance)", plain):
            return repr((-1 if plain.startswith("-") else 1) * z.imag * unit)
        return repr(z.real * unit) if re.match(r"(re\(z\)|re\(ohm|z' |z'/|z real|resistance)", plain) else "0.5"

    body = "\n".join(separator.join(cell(t, f, z) for t in titles) for f, z in zip(F.tolist(), Z.tolist(), strict=True))
    path = write(tmp_path / "z.txt", PREAMBLE + separator.join(titles) + "\n" + body)
    found = read(path)
    assert isinstance(found, Spectrum)
    assert found.frequency == pytest.approx(F[::-1], rel=1e-12)
    assert found.impedance == pytest.approx(Z[::-1], rel=1e-12)
    assert set(found.headers) == {"frequency", "re", "im"}


STAMPS = {
    "2024-03-01 23:59:{:05.2f}": "time_s,voltage_V,current_A\n",
    "2024-03-01T23:59:{:05.2f}Z": "time_s,voltage_V,current_A\n",
    "01.03.2024 23:59:{:05.2f}": "time_s;voltage_V;current_A\n",
}


@pytest.mark.parametrize("stamp", STAMPS)
def test_a_date_and_time_is_the_time_of_its_first_day(stamp: str, tmp_path: Path) -> None:
    header = STAMPS[stamp]
    sign = header[6]
    rows = [sign.join((stamp.format(t), f"{u:g}", f"{i:.12g}")) for t, u, i in zip(T, U, I, strict=True)]
    path = write(tmp_path / "record.csv", header + "\n".join(rows) + "\n")
    assert read_columns(path, RECORD).time == pytest.approx(T + 86340, abs=1e-6)


def test_braces_are_brackets_and_a_current_by_area_is_not_suggested(tmp_path: Path) -> None:
    body = "".join(f"{t:g},{u:g},{i:.12g}\n" for t, u, i in zip(T, U, I, strict=True))
    path = write(tmp_path / "record.csv", "Time [s],E (V),I {A}\n" + body)
    assert read_columns(path, RECORD).columns["current"] == pytest.approx(I, abs=1e-12)
    write(path, "Time (s),E (V),Current density (mA/cm\u00b2)\n" + body)
    with pytest.raises(InputError, match="no column for current") as caught:
        read(path)
    assert "--units" not in str(caught.value)


def test_a_title_that_cannot_be_printed_is_suggested_by_its_number(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    body = "".join(f"{t:g},{u:g},{i:.12g}\n" for t, u, i in zip(T, U, I, strict=True))
    path.write_bytes("\u0412\u0440\u0435\u043c\u044f[s],\u0411[V],\u0412\u0422[A]\n".encode("cp866") + body.encode())
    with pytest.raises(InputError, match=r"if so: columns={'time': '1', 'voltage': '2', 'current': '3'}$"):
        read(path)
