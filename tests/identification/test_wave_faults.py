"""Records of waves with missing rows, drift, answers at a limit and held frames, beside the response that is true."""

from __future__ import annotations

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.arrays import Array, Mask
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.identification.frequency_response import BodeOfRecords

STEP, NOISE = 0.25, 0.01
Record = dict[str, Array]


def recorded(drive: str, duration: float) -> Record:
    run = ilg.simulate("paper", drive, times=np.arange(0, duration, STEP), engine="exact", beam="static")
    still = np.zeros(40)
    rows = {"voltage_V": run.voltage, "displacement_m": run.displacement, "current_A": run.current}
    found = {name: np.r_[still, row] for name, row in rows.items()}
    return {"time_s": np.arange(len(found["voltage_V"])) * STEP, **found}


@pytest.fixture(scope="module")
def chirp() -> Record:
    return recorded("chirp:1V,20mHz..0.5Hz", 400.0)


@pytest.fixture(scope="module")
def sine() -> Record:
    return recorded("sine:1V,0.05Hz", 200.0)


def noisy(record: Record, seed: int, amount: float = NOISE) -> Record:
    random = np.random.default_rng([17, seed])
    moved = ("displacement_m", "current_A")
    return {
        **record,
        **{q: x + amount * np.ptp(x) * random.standard_normal(len(x)) for q in moved for x in [record[q]]},
    }


def without(record: Record, begin: float, end: float) -> Record:
    kept = (record["time_s"] < begin) | (record["time_s"] > end)
    return {name: values[kept] for name, values in record.items()}


def drifting(record: Record, rate: float) -> Record:
    return {**record, "displacement_m": record["displacement_m"] + rate * record["time_s"]}


def outside(found: BodeOfRecords, name: str = "displacement") -> Array:
    """Where the true response is outside the 95 % circle, in radii of it."""
    true = ilg.bode("paper", frequency=found.frequency, beam="static").response(name)
    return np.asarray(np.abs(found.response(name) - true) / found.radius(name))


def test_clean_records_are_not_blamed(chirp: Record, sine: Record) -> None:
    for seed in range(20):
        found = ilg.bode_of(noisy(chirp, seed))
        assert not codes(found.findings)
        assert len(found.frequency) == 14
    for seed in range(5):
        assert set(codes(ilg.bode_of(noisy(sine, seed)).findings)) <= {"transient-left-out"}


@pytest.mark.parametrize(("begin", "long"), [(60, 5), (100, 5), (100, 30), (200, 10), (300, 15), (360, 30)])
def test_a_chirp_has_no_answer_where_its_rows_are_missing(chirp: Record, begin: float, long: float) -> None:
    """A straight line over the gap: 15 % off by 12 standard errors, and nothing said."""
    misses = []
    for seed in range(3):
        found = ilg.bode_of(without(noisy(chirp, seed), begin, begin + long))
        assert {"sweep-gap", "longest-stretch"} & codes(found.findings)
        told = found.findings[0].values
        assert told["from"] == pytest.approx(begin - STEP)
        assert told["long"] == pytest.approx(long + 2 * STEP)
        assert 8 <= len(found.frequency) < 14
        misses.append(outside(found))
    every = np.concatenate(misses)
    assert every.max() < 2.0
    assert (every > 1).mean() < 0.15


def test_a_few_lost_rows_are_read_off_between_the_others(chirp: Record) -> None:
    kept = np.sort(np.random.default_rng(3).choice(1640, 1480, replace=False))
    found = ilg.bode_of({name: values[kept] for name, values in noisy(chirp, 1).items()})
    assert len(found.frequency) >= 10
    assert outside(found).max() < 1.5


@pytest.mark.parametrize("rate", [5e-7, -1e-6, 5e-6])
def test_a_drift_under_a_chirp_is_taken_off(chirp: Record, rate: float) -> None:
    """5 um/s, twice the motion over the record: the response at the low end was wrong by many standard errors."""
    span = float(np.ptp(chirp["displacement_m"]))
    for seed in range(3):
        plain, found = ilg.bode_of(noisy(chirp, seed)), ilg.bode_of(drifting(noisy(chirp, seed), rate))
        assert codes(found.findings) == {"answer-drifts"}
        assert found.findings[0].values["rate"] == pytest.approx(rate, abs=0.05 * span / 400)  # in parts of the motion
        assert outside(found).max() < max(1.0, 1.2 * float(outside(plain).max()))
        assert (found.radius("displacement") >= 0.7 * plain.radius("displacement")).all()


def test_a_sine_with_a_gap_is_a_sine(sine: Record) -> None:
    """13 s missing of 200 s: noise, with nine invented frequencies."""
    for seed in range(3):
        found = ilg.bode_of(without(noisy(sine, seed), 90.0, 103.0))
        assert found.excited == {"record": "sines"}
        assert "sines-gap" in codes(found.findings)
        assert outside(found).max() < 1.5  # of 95 % circles some may be left


def test_a_current_at_its_limit_tells_no_response(sine: Record) -> None:
    """Clipped at 70 %: 19 % off, and nothing said."""
    record = noisy(sine, 0, 0.001)
    limit = 0.7 * record["current_A"].max()
    found = ilg.bode_of({**record, "current_A": np.clip(record["current_A"], -limit, limit)})
    assert "answer-clipped" in codes(found.findings)
    assert list(found.responses) == ["displacement"]
    limit = 0.5 * record["displacement_m"].max()
    with pytest.raises(InputError, match="stands still at its limit"):
        ilg.bode_of({**record, "displacement_m": np.clip(record["displacement_m"], -limit, limit)})


def held(record: Record, kept: Mask) -> Record:
    last = np.maximum.accumulate(np.where(kept, np.arange(len(kept)), 0))
    return {**record, "displacement_m": record["displacement_m"][last]}


def test_held_frames_are_left_out(chirp: Record, sine: Record) -> None:
    """Half of the frames held: 8 % off by nine standard errors, and nothing said."""
    for seed in range(3):
        record = noisy(sine, seed, 0.002)
        kept = np.random.default_rng([4, seed]).random(len(record["time_s"])) < 0.5
        found = ilg.bode_of(held(record, kept))
        assert "frames-held" in codes(found.findings)
        assert outside(found).max() < 1.5
    record = noisy(chirp, 0)
    every_fourth = np.arange(len(record["time_s"])) % 4 == 0
    found = ilg.bode_of(held(record, every_fourth))
    assert codes(found.findings) == {"frames-held"}
    assert outside(found).max() < 1.5


def test_a_coarse_camera_holds_no_frames(chirp: Record) -> None:
    record = noisy(chirp, 0)
    record["displacement_m"] = np.round(record["displacement_m"] / 2e-5) * 2e-5
    assert not codes(ilg.bode_of(record).findings)


def test_no_bandwidth_is_told_where_its_frequency_was_not_swept(chirp: Record) -> None:
    true = ilg.bode("paper", "20mHz", "0.5Hz", points=400, beam="static").bandwidth
    assert true is not None
    swept = 400.0 * np.log(true / 0.02) / np.log(0.5 / 0.02)  # when it was driven
    widths = {}
    for name, (begin, end) in {"there": (swept - 12, swept + 12), "elsewhere": (swept + 100, swept + 115)}.items():
        found = ilg.bode_of(without(noisy(chirp, 1), 10 + begin, 10 + end))
        assert "sweep-gap" in codes(found.findings)
        widths[name] = found.bandwidth
    assert widths["there"] is None
    assert widths["elsewhere"] is not None


def test_few_readings_a_period_are_no_gaps() -> None:
    t = np.arange(0.0, 101.0, 2.0)
    found = ilg.bode_of({"time_s": t, "voltage_V": np.sin(t), "displacement_mm": np.cos(t)})
    assert "sines-gap" not in codes(found.findings)
    assert found.response("displacement") == pytest.approx([1e-3j], rel=1e-6)
