"""What is said and seen of a record's beginning: stated onsets, jumps within a record, rest or a run before it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic import drives, record

from ilg_circuit.findings import codes
from ilg_circuit.measurements.onset import Stated
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.table import Table

Array = NDArray[np.float64]


@pytest.mark.parametrize("rest", [0, 20])
@pytest.mark.parametrize(("stated", "share"), [("first-level", 0.5), ("last-rest", -0.5), (None, 0.0)])
def test_a_stated_onset_says_where_all_jumps_lie(stated: Stated, share: float, rest: int) -> None:
    """A square wave every 2 s, up or down every 30 s, read from its first level on or from before it."""
    r = prepare(record(drives(4.0)["square"], 300.0, 151, rest=rest, noise=1e-3).table(), stated)
    jumps = r.drive.jumps(np.inf)
    # a jump that is shown at t lies between t - 2 s and t, the onset the same but where there is no reading before it
    onset = (share - 0.5) * 2.0 if rest else 0.0
    assert r.onset == pytest.approx(2.0 * rest + onset)
    assert jumps == pytest.approx(30.0 * np.arange(1, len(jumps) + 1) + (share - 0.5) * 2.0 - onset, abs=1e-5)
    assert r.voltage.widths[1:] == pytest.approx(2.0)
    assert (r.voltage.stated is None) == (stated is None)


def test_a_time_that_is_stated_without_rest_leaves_the_other_jumps_open() -> None:
    r = prepare(record(drives(4.0)["square"], 300.0, 151, noise=1e-3).table(), 0.0)
    assert r.onset == 0.0
    assert r.voltage.widths[0] == 0
    assert r.voltage.widths[1:] == pytest.approx(2.0)


def test_a_waveform_that_begins_with_the_record_is_a_run_or_begins_where_it_is_stated() -> None:
    table = record(drives(4.0)["square"], 300.0, 301, noise=1e-3).table()
    unknown, stated = prepare(table), prepare(table, "first-level")
    assert (unknown.beginning, stated.beginning) == ("run", "step")
    assert "begins-within-run" in codes(unknown.notes)
    assert "onset-assumed" in codes(stated.notes)


def rested(rest: Array) -> Table:
    """A step of 4 V after readings of the current at ``rest`` [A]."""
    after = 1.0 * np.arange(60)
    current = np.concatenate([rest, 0.006 + 0.2 * np.exp(-after / 7)])
    voltage = np.concatenate([np.zeros(len(rest)), np.full(60, 4.0)])
    current += 6e-4 * np.random.default_rng(len(rest)).standard_normal(len(current))
    return Table({"time": 1.0 * np.arange(len(current)), "voltage": voltage, "current": current}, "rest.csv")


@pytest.mark.parametrize("count", [1, 5, 9, 10, 11, 12, 13, 15, 16, 20, 40])
def test_a_rest_of_any_length_is_one(count: int) -> None:
    found = prepare(rested(np.zeros(count)))
    assert (found.beginning, int(found.current.rest.sum())) == ("rest", count)


@pytest.mark.parametrize("count", [20, 40])
def test_a_current_that_decays_is_no_rest(count: int) -> None:
    found = prepare(rested(-0.1 * np.exp(-np.arange(count) / 7)))
    assert found.beginning == "run"
