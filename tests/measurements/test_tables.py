"""Measured tables: what a header may look like, and what is said of a file that cannot be read."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ilg_circuit.errors import InputError
from ilg_circuit.measurements.kind import RECORD
from ilg_circuit.measurements.read import read_columns, read_waveform
from ilg_circuit.measurements.table import Table

Reader = Callable[[str | bytes], Table]

TIMES = RECORD.requiring("time")


@pytest.fixture
def read(tmp_path: Path) -> Reader:
    def of(content: str | bytes) -> Table:
        path = tmp_path / "data.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_columns(path, TIMES)

    return of


# -- headers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "quantity", "factor"),
    [
        ("voltage_V", "voltage", 1.0),
        ("voltage_mV", "voltage", 1e-3),
        ("Voltage [mV]", "voltage", 1e-3),
        ("VOLTAGE (kV)", "voltage", 1e3),
        ("voltage/mV", "voltage", 1e-3),
        ("Voltage / mV", "voltage", 1e-3),
        ("  voltage_V  ", "voltage", 1.0),
        ("cell_voltage_V", "voltage", 1.0),
        ("Cell voltage (V)", "voltage", 1.0),
        ("u_V", "voltage", 1.0),
        ("potential_V", "voltage", 1.0),
        ("current_mA", "current", 1e-3),
        ("I [uA]", "current", 1e-6),
        ("current_\N{MICRO SIGN}A", "current", 1e-6),
        ("current_\N{GREEK SMALL LETTER MU}A", "current", 1e-6),
        ("displacement_mm", "displacement", 1e-3),
        ("laser_displacement_mm", "displacement", 1e-3),
        ("tip deflection (um)", "displacement", 1e-6),
        ("position_m", "displacement", 1.0),
        ("force_N", "force", 1.0),
        ("force [mN]", "force", 1e-3),
        ("charge_C", "charge", 1.0),
        ("charge_mC", "charge", 1e-3),
    ],
)
def test_headers(read: Reader, header: str, quantity: str, factor: float) -> None:
    table = read(f"time_s,{header}\n0,2\n1,-3.5\n")
    assert table.columns[quantity] == pytest.approx(np.array([2.0, -3.5]) * factor, rel=1e-15)
    assert table.ignored == ()
    assert table.source == "data.csv"


@pytest.mark.parametrize(
    ("header", "factor"),
    [("time_s", 1.0), ("time_ms", 1e-3), ("t_s", 1.0), ("t_nominal_s", 1.0), ("Time [min]", 60.0), ("time/h", 3600.0)],
)
def test_times(read: Reader, header: str, factor: float) -> None:
    assert read(f"{header},voltage_V\n0,1\n2,1\n").time == pytest.approx(np.array([0, 2]) * factor)


@pytest.mark.parametrize(
    "header", ["notes", "temperature_K", "voltage_noise_level", "current range", "velocity_mm/s", ""]
)
def test_other_columns_are_left_alone_and_named(read: Reader, header: str) -> None:
    table = read(f"time_s,voltage_V,{header}\n0,1,hello\n1,2,\n")
    assert set(table.columns) == {"time", "voltage"}
    assert table.ignored == (header,)


@pytest.mark.parametrize(
    ("header", "hint"),
    [
        ("voltage", r"column 'voltage' has no unit; write it like 'voltage_V'"),
        ("U", r"column 'U' has no unit"),
        ("cell_current", r"write it like 'cell_current_A'"),
        ("voltage_v", r"column 'voltage_v': unknown unit 'v'"),
        ("voltage_A", r"column 'voltage_A': unit 'A' does not measure"),
        ("current [A/cm^2]", r"unit 'A/cm^2' is one per area; multiply by the electrode's area"),
        ("current_A/m^2", r"is one per area"),
        ("I/mA cm-2", r"is one per area"),
        ("voltage_dB", r"column 'voltage_dB'"),
    ],
)
def test_headers_without_a_right_unit_are_named(read: Reader, header: str, hint: str) -> None:
    with pytest.raises(InputError, match=r"data\.csv: .*" + hint.replace("[", r"\[").replace("^", r"\^")):
        read(f"time_s,{header}\n0,1\n1,2\n")


def test_ambiguous_columns_are_named(read: Reader) -> None:
    with pytest.raises(InputError, match="columns 'voltage_V' and 'cell_voltage_mV' both give the voltage; leave one"):
        read("time_s,voltage_V,cell_voltage_mV\n0,1,1000\n1,2,2000\n")


def test_missing_columns_are_named_with_what_was_not_understood(read: Reader, tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match="no column for time; not understood: 'tempo_s'; columns are written like time_s"
    ):
        read("tempo_s,voltage_V\n0,1\n1,2\n")
    read("time_s,voltage_V\n0,1\n1,2\n")
    with pytest.raises(InputError, match="no column for current"):
        read_columns(tmp_path / "data.csv", RECORD.requiring("time", "current"))


# -- cells -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("blank", ["", "  ", "nan", "NaN", '""'])
def test_blanks_are_gaps(read: Reader, blank: str) -> None:
    table = read(f"time_s,voltage_V\n0,1\n1,{blank}\n2,3\n")
    assert np.isnan(table.columns["voltage"]).tolist() == [False, True, False]


def test_short_rows_are_gaps_and_trailing_commas_harmless(read: Reader) -> None:
    table = read("time_s,voltage_V,current_A\n0,1\n1,2,3,,\n2,\n")
    assert table.columns["current"] == pytest.approx(np.array([np.nan, 3.0, np.nan]), nan_ok=True)


def test_a_column_of_blanks_is_none(read: Reader) -> None:
    table = read("time_s,voltage_V,force_N\n0,1,\n1,2,\n")
    assert table.get("force") is None
    assert table.get("charge") is None
    assert table.get("voltage") is not None


@pytest.mark.parametrize("cell", ["x", "1 V", "1,5", "1_000", "0x10", "1d3", "-x", "1-"])
def test_text_in_a_number_names_line_and_column(read: Reader, cell: str) -> None:
    with pytest.raises(InputError, match=r"data\.csv: line 4, column 'voltage_V': '.*' is not a number"):
        read(f'# a comment\ntime_s,voltage_V\n0,1\n1,"{cell}"\n')


def test_text_in_a_column_that_is_not_used_is_harmless(read: Reader) -> None:
    assert len(read("time_s,note,voltage_V\n0,hot,1\n1,cold,2\n").time) == 2


def test_too_many_cells_name_the_line(read: Reader) -> None:
    with pytest.raises(InputError, match=r"line 3 has 3 cells, the header 2"):
        read("time_s,voltage_V\n0,1\n1,2,3\n")


@pytest.mark.parametrize(
    "text",
    [
        "time_s;voltage_V\n0,5;1,25\n1,5;-2\n",
        "time_s;voltage_V\n0.5;1.25\n1.5;-2\n",
        "time_s\tvoltage_V\n0.5\t1.25\n1.5\t-2\n",
        "time_s,voltage_V\r\n0.5,1.25\r\n1.5,-2\r\n",
        "\N{ZERO WIDTH NO-BREAK SPACE}time_s,voltage_V\n0.5,1.25\n1.5,-2\n",
        "\n# made by X\n\ntime_s,voltage_V\n# now\n0.5,1.25\n\n1.5,-2\n\n",
        "time_s,voltage_V\n 0.5 , 1.25 \n1.5,-2",
        '"time_s","voltage_V"\n"0.5","1.25"\n"1.5","-2"\n',
        "voltage_V,time_ms\n1.25,500\n-2,1500\n",
        "time_s,voltage_V\n5e-1,+1.25\n1.5,-2e0\n",
        "time_s voltage_V\n  0.5    1.25\n  1.5   -2\n",
        "time_s, voltage_V\n0.5 1.25\n1.5 -2\n",
    ],
    ids=[
        *("decimal commas", "semicolons", "tabs", "CRLF", "BOM", "comments", "spaces", "quotes", "order", "exponents"),
        *("columns of spaces", "columns of spaces under commas"),
    ],
)
def test_dialects(read: Reader, text: str) -> None:
    table = read(text)
    assert table.time.tolist() == [0.5, 1.5]
    assert table.columns["voltage"].tolist() == [1.25, -2.0]


def test_lines_are_counted_as_an_editor_does(read: Reader) -> None:
    with pytest.raises(InputError, match="line 6"):
        read("# one\n\ntime_s,voltage_V\n0,1\n# five\n1,x\n")


# -- times -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("times", "hint"),
    [
        ("0 1 1", "line 4: time 1 s repeats 1 s; leave one row out"),
        ("0 0 1 1 1", "line 3: time 0 s repeats 0 s, as 3 of 5 do: write times with more digits"),
        ("0 1 0.5", "line 4: time 0.5 s goes back from 1 s; sort the file by time"),
    ],
)
def test_times_ascend(read: Reader, times: str, hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        read("time_s,voltage_V\n" + "".join(f"{t},1\n" for t in times.split()))


def test_every_row_needs_a_time(read: Reader) -> None:
    with pytest.raises(InputError, match="line 3 has no time"):
        read("time_s,voltage_V\n0,1\n,2\n")


def test_negative_times_are_fine(read: Reader) -> None:
    assert read("time_s,voltage_V\n-1,1\n0,2\n").time.tolist() == [-1.0, 0.0]


# -- files that are none -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "hint"),
    [
        ("", "the file is empty; it needs a header row such as time_s"),
        ("\n \n", "the file is empty"),
        ("# only\n# comments\n", "the file is empty"),
        ("time_s,voltage_V\n", "there is a header but no row"),
        (b"PK\x03\x04\x00\x00", "not a text file"),
        (b"time_s\x00,voltage_V\n0,1\n", "not a text file"),
        (b"PK\x03\x04\x14\x00\x06\x00", "not a text file"),
        ("0,1\n1,2\n", "no column for time: the first row holds numbers, not names; put a row of names above it"),
        ("0 1\n1 2\n", "no column for time: the first row holds numbers"),
    ],
)
def test_what_is_no_table(read: Reader, content: str | bytes, hint: str) -> None:
    with pytest.raises(InputError, match=r"data\.csv: " + hint):
        read(content)


def test_missing_files_and_folders(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cannot read '.*none\.csv': No such file"):
        read_columns(tmp_path / "none.csv", TIMES)
    with pytest.raises(InputError, match="cannot read"):
        read_columns(tmp_path, TIMES)


@pytest.mark.parametrize(
    "content",
    [
        "time_s,voltage_V\n0," + "1" * 200_000 + "\n",
        'time_s,voltage_V\n0,"1\n1,2\n',
        'time_s,voltage_V\n0,"1\n2"\n1,2\n',
        "time_h,voltage_V\n0,1\n1e308,2\n",
        "time_s,voltage_kV\n0,1e308\n1,1\n",
        "time_s,voltage_V\n-1.7e308,1\n1.7e308,2\n",
        "time_" + "s" * 1500 + ",voltage_V\n0,1\n",
    ],
    ids=[
        "endless cell",
        "open quote",
        "line end in a cell",
        "overflow of time",
        "overflow",
        "endless span",
        "endless unit",
    ],
)
def test_hostile_tables_are_refused_as_input(read: Reader, content: str) -> None:
    with suppress(InputError):
        table = read(content)
        assert not any(np.isinf(column).any() for column in table.columns.values())


CELL = st.one_of(
    st.floats().map(repr),
    st.sampled_from(["", "x", "1,5", '"', "1e999", "nan", "#", "\u2028", "\x00", "0", "1", "2"]),
    st.text(max_size=6),
)
HEADERS = st.sampled_from(["time_s", "voltage_V", "I [mA]", "time/ms", "current", "force_N", "notes", '"', "u_kV", ""])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150)
@given(
    header=st.lists(HEADERS, min_size=1, max_size=4),
    rows=st.lists(st.lists(CELL, max_size=4), max_size=6),
    delimiter=st.sampled_from([",", ";", "\t"]),
)
def test_random_tables_are_read_or_refused_as_input(
    read: Reader, header: list[str], rows: list[list[str]], delimiter: str
) -> None:
    text = "\n".join(delimiter.join(row) for row in [header, *rows])
    try:
        table = read(text.encode("utf-8", "surrogatepass"))
    except InputError:
        return
    assert np.isfinite(table.time).all()
    assert (np.diff(table.time) > 0).all()
    assert len({len(column) for column in table.columns.values()}) == 1


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.one_of(st.binary(max_size=200), st.text(max_size=200).map(lambda t: t.encode("utf-8", "surrogatepass"))))
def test_garbage_is_refused_as_input(read: Reader, content: bytes) -> None:
    with pytest.raises(InputError):
        read(content)


# -- waveforms ---------------------------------------------------------------------------------------------------------


def test_waveforms_leave_blanks_out(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("time_s,voltage_V,current_A\n0,1,\n1,,5\n2,3,6\n")
    times, values, _ = read_waveform(path, "voltage")
    assert (times.tolist(), values.tolist()) == ([0.0, 2.0], [1.0, 3.0])


def test_a_waveform_of_blanks_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("time_s,voltage_V\n0,\n1,\n")
    with pytest.raises(InputError, match="the column for voltage has no number in it"):
        read_waveform(path, "voltage")


def test_a_real_measurement(shared_data: Callable[[str], Path]) -> None:
    needed = RECORD.requiring("time", "voltage", "current", "displacement")
    table = read_columns(shared_data("ipmc_step/step_1V5.csv"), needed)
    assert len(table.time) == 1622
    assert table.ignored == ()
    assert set(table.columns) == {"time", "voltage", "current", "displacement", "force"}
    assert table.columns["voltage"].max() == pytest.approx(1.5, abs=0.1)
    assert table.columns["displacement"][0] == pytest.approx(5.58e-3, abs=0.1e-3)
