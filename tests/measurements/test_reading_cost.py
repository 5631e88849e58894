"""What reading costs: memory beside the file, and time in proportion to a line."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.measurements.kind import RECORD
from ilg_circuit.measurements.read import read, read_columns

_ROWS = 60_000


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    t = np.arange(_ROWS) * 0.01
    y = np.random.default_rng(3).normal(0, 1, _ROWS)
    path = tmp_path_factory.mktemp("large") / "large.csv"
    rows = (f"{a:.2f},{4 * (a > 10)},{6 + b:.6g},{b:.5g}" for a, b in zip(t.tolist(), y.tolist(), strict=True))
    path.write_text("\n".join(["time_s,voltage_V,current_mA,displacement_mm", *rows]))
    return path


def seconds(run: Callable[[], object]) -> float:
    """Processor time [s], the least of three."""

    def once() -> float:
        begin = time.process_time()
        run()
        return time.process_time() - begin

    return min(once() for _ in range(3))


def test_a_table_takes_at_most_ten_times_the_file_s_memory(large: Path) -> None:
    read_columns(large, RECORD)  # the units are looked up once
    tracemalloc.start()
    try:
        table = read_columns(large, RECORD)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(table.time) == _ROWS
    assert peak < 10 * large.stat().st_size


LINES = ("time_s ", "a;", "( ", " vs", "z' re ", "\t ", 'x"', "Ewe/V,", "1,", "freq (  ", "/", " ", "1 ", "[")


@pytest.mark.parametrize("line", LINES)
def test_time_is_in_proportion_to_the_length_of_a_line(line: str, tmp_path: Path) -> None:
    """A quadratic reader takes sixteen times as long for four times the line."""
    path = tmp_path / "wide.csv"

    def taken(length: int) -> float:
        text = "\n".join([(line * length)[:length]] * 8)
        path.write_text(f"{text}\ntime_s,voltage_V,current_A\n0,1,2\n1,1,2\n")

        def attempt() -> None:
            with suppress(InputError):
                read(path)

        return seconds(attempt)

    assert taken(9_600) < 9 * taken(2_400) + 0.02
