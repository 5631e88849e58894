"""Runs, sweeps and their files and pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.oscillators.network import chain, default_start, ring, unit
from ilg_circuit.oscillators.rhythm import rhythm
from ilg_circuit.oscillators.run import default_times, run
from ilg_circuit.oscillators.sweep import sweep
from ilg_circuit.report.axes import save


def rows(path: Path) -> tuple[list[str], np.ndarray]:
    header, *lines = path.read_text().splitlines()
    return header.split(","), np.array([[float(c) if c else np.nan for c in line.split(",")] for line in lines])


def test_a_run_as_a_file(tmp_path: Path) -> None:
    result = run(unit(), default_times(unit(), 20.0))
    result.write_csv(tmp_path / "cpg.csv")
    header, table = rows(tmp_path / "cpg.csv")
    assert header == ["time_s", "neuron_1", "neuron_2", "output"]
    assert table[:, 0] == pytest.approx(np.arange(20001) * 1e-3)
    assert table[:, 1:3].min() == 0
    assert (table[:, 3] == table[:, 1] - table[:, 2]).all()
    late = table[table[:, 0] > 15]
    assert np.ptp(late[:, 3]) / 2 == pytest.approx(0.462008, abs=1e-5)
    ups = late[1:][(late[1:, 3] > 0) & (late[:-1, 3] <= 0)][:, 0]
    assert np.diff(ups).mean() == pytest.approx(1.035463, abs=1e-3)


def test_a_chain_has_its_units_too(tmp_path: Path) -> None:
    result = run(chain(2), [0.0, 1.0, 2.0])
    result.write_csv(tmp_path / "cpg.csv")
    header, table = rows(tmp_path / "cpg.csv")
    assert header == ["time_s", *(f"neuron_{k}" for k in range(1, 5)), "output", "unit_1", "unit_2"]
    assert (table[:, 7] == table[:, 3] - table[:, 4]).all()
    told = result.to_dict()
    assert len(told["unit_lags_deg"]) == 2
    assert "degrees behind the unit before" in result.summary()


def test_what_is_told() -> None:
    told = run(unit(), [0.0, 20.0]).to_dict()
    assert told["oscillates"] is True
    assert told["period_s"] == pytest.approx(1.035463, abs=5e-7)
    assert told["amplitude"] == pytest.approx(0.462008, abs=5e-7)
    assert told["warnings"] == []
    assert told["rest_states"] == [
        {"active": [1, 2], "stable": False, "growth_per_s": pytest.approx((1.5 / 0.12 - 1 / 0.3) / 2)}
    ]
    still = run(unit(5.0), [0.0, 20.0]).to_dict()
    assert still["oscillates"] is False
    assert still["period_s"] is None
    assert still["amplitude"] == 0
    assert sorted(still["rest_outputs"]) == pytest.approx([0, 0.25])
    assert still["phase_lags_deg"] == [None, None]


@pytest.mark.parametrize(("duration", "hint"), [(0.1, "too short to show one period"), (2.0, "before the motion has")])
def test_a_duration_that_shows_too_little(duration: float, hint: str) -> None:
    result = run(unit(), default_times(unit(), duration))
    assert hint in result.warnings[0]
    assert result.period == pytest.approx(1.035463, abs=5e-7)
    assert run(unit(5.0), [0.0, 3.0]).warnings == ()
    resting = run(unit(5.0), [0.0, 0.01])
    assert "it comes to rest later" in resting.warnings[0]


def test_neurons_alike_stay_alike_for_ever() -> None:
    """Bit by bit: rounding alone would part them within a minute."""
    result = run(ring(5), [0.0, 100.0, 1000.0], [0.12] * 5 + [0.0] * 5)
    assert (result.outputs == result.outputs[:, :1]).all()


def test_ngspice_as_the_engine() -> None:
    times = np.linspace(0, 5, 501)
    exact, other = run(unit(), times), run(unit(), times, engine="ngspice")
    assert other.period == pytest.approx(exact.period, rel=1e-5)
    assert other.amplitude == pytest.approx(exact.amplitude, rel=1e-5)
    assert other.period != exact.period
    assert 0 < other.error <= 1e-5
    assert other.outputs == pytest.approx(exact.outputs, abs=1e-4)
    assert "solved by ngspice" in other.summary()


@pytest.mark.parametrize(
    ("times", "hint"),
    [
        ([], "finite and not negative"),
        ([-1.0, 1.0], "finite and not negative"),
        ([0.0, np.nan], "finite"),
        ([0.0, 2.0, 1.0], "must ascend"),
        ([0.0], "more than zero"),
    ],
)
def test_times_that_are_none(times: list[float], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        run(unit(), times)


@pytest.mark.parametrize("duration", [0.0, -1.0, np.nan, np.inf])
def test_durations_that_are_none(duration: float) -> None:
    with pytest.raises(InputError, match="must be more than zero"):
        default_times(unit(), duration)


def test_default_samples_stay_bounded() -> None:
    assert default_times(unit(), 20.0)[1] == pytest.approx(1e-3)
    assert len(default_times(unit(), 1e6)) <= 100_001
    assert default_times(unit(), 1e-3)[-1] == 1e-3
    assert len(default_times(unit(), 1e-3)) >= 100


def test_an_engine_that_is_none() -> None:
    with pytest.raises(InputError, match="choose ode or ngspice"):
        run(unit(), [0.0, 1.0], engine="xyce")


def test_sweeps(tmp_path: Path) -> None:
    values = [1.0, 1.4, 2.5, 3.0, 5.0]
    done: list[tuple[int, int]] = []
    found = sweep(unit, "inhibition", values, progress=lambda k, n: done.append((k, n)))
    assert done == [(k, 5) for k in range(1, 6)]
    assert found.outcomes == ("rest", "undecided", "cycle", "cycle", "rest")
    assert found.oscillates.tolist() == [False, False, True, True, False]
    alone = rhythm(unit(3.0))
    assert (found.period[3], found.amplitude[3]) == (alone.period, alone.amplitude)
    found.write_csv(tmp_path / "sweep.csv")
    assert (tmp_path / "sweep.csv").read_text().splitlines()[:3] == [
        "inhibition,oscillates,period_s,amplitude",
        "1.0,0,,0.0",
        "1.4,,,",
    ]
    with pytest.raises(InputError, match="cannot sweep 'colour'"):
        sweep(unit, "colour", values)
    with pytest.raises(InputError, match="1 to 10000 values, not 0"):
        sweep(unit, "tonic", [])


def test_the_papers_sweeps() -> None:
    """CPG §6.4.1: e scales the amplitude only. §6.4.2: Tr slows the rhythm until it ends. §6.4.3: so does a."""
    tonic = sweep(lambda e: unit(tonic=e), "tonic", [0.5, 1.0, 4.0], default_start(unit()))
    assert tonic.period == pytest.approx(np.full(3, 1.035463), abs=5e-7)
    assert tonic.amplitude == pytest.approx(0.462008 * np.array([0.5, 1, 4]), rel=2e-6)
    rise = sweep(lambda tr: unit(rise_time=tr), "rise-time", np.arange(1, 11) / 10)
    assert rise.oscillates.tolist() == [True] * 4 + [False] * 6
    assert (np.diff(rise.period[:4]) > 0).all()
    assert (np.diff(rise.amplitude[:4]) < 0).all()
    inhibition = sweep(lambda a: unit(a, rise_time=0.1), "inhibition", np.arange(1, 8))
    assert inhibition.oscillates.tolist() == [False, True, True, False, False, False, False]


@pytest.mark.parametrize(
    ("network", "duration"),
    [(unit(), 5.0), (unit(5.0), 2.0), (ring(7), 3.0), (chain(4), 5.0), (unit(), 60.0)],
    ids=["unit", "rest", "many", "chain", "long"],
)
def test_pictures_of_runs(tmp_path: Path, network: object, duration: float) -> None:
    result = run(network, default_times(network, duration))  # type: ignore[arg-type]
    save(result.figure(), tmp_path / "cpg.png")
    assert (tmp_path / "cpg.png").stat().st_size > 20_000


def test_a_picture_of_ngspices_run_and_of_sweeps(tmp_path: Path) -> None:
    save(run(unit(), np.linspace(0, 3, 301), engine="ngspice").figure(), tmp_path / "cpg.svg")
    text = (tmp_path / "cpg.svg").read_text()
    assert text.startswith("<?xml")
    save(sweep(unit, "inhibition", [1.0, 1.4, 2.5, 3.0]).figure(), tmp_path / "sweep.png")
    save(sweep(unit, "inhibition", [2.5]).figure(), tmp_path / "one.pdf")
    assert (tmp_path / "sweep.png").stat().st_size > 10_000
    assert (tmp_path / "one.pdf").read_bytes().startswith(b"%PDF")
