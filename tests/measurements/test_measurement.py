"""From a table to a fit's data: onset, jumps, levels, clipping, blanks, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import Synthetic, ready, record, step

from ilg_circuit.drive import PiecewiseLinear, Sine
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.identification import identify
from ilg_circuit.measurements.curves import between_samples
from ilg_circuit.measurements.read import read_record
from ilg_circuit.measurements.smoothing import noise_level
from ilg_circuit.measurements.table import Table
from ilg_circuit.measurements.voltage import simplified
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

Reader = Callable[[str], None]


def step_table(
    rest: int = 30, samples: int = 100, interval: float = 0.5, voltage: float = 4.0, start: float = 0.0
) -> Table:
    """A step after ``rest`` samples and a current that decays, without noise."""
    time = np.arange(rest + samples) * interval
    since = time - rest * interval
    on = np.arange(len(time)) >= rest
    current = np.where(on, voltage * (0.0015 + 0.05 * np.exp(-np.maximum(since, 0) / 7)), 0.0)
    return Table({"time": time + start, "voltage": np.where(on, voltage, 0.0), "current": current}, "step.csv")


def with_voltage(table: Table, voltage: np.ndarray) -> Table:
    return Table({**table.columns, "voltage": voltage}, table.source)


# -- onset -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("voltage", [4.0, -4.0, 0.02, 400.0])
@pytest.mark.parametrize("start", [0.0, -30.0, 1e6])
def test_onset_after_a_zero_stretch(voltage: float, start: float) -> None:
    m = ready(step_table(voltage=voltage, start=start))
    assert m.onset == start + 15.0
    assert m.step == pytest.approx(voltage, rel=1e-12)
    assert m.current.time[0] == -15.0
    assert m.current.time[m.current.rest].max() < 0 <= m.current.time[~m.current.rest].min()
    assert m.duration == 49.5
    assert m.drive.value([0.0, 49.0]).tolist() == pytest.approx([voltage, voltage], rel=1e-12)


@pytest.mark.parametrize("voltage", [4.0, -4.0])
def test_a_step_at_the_first_sample(voltage: float) -> None:
    m = ready(step_table(rest=0, voltage=voltage, start=7.0))
    assert (m.onset, m.step) == (7.0, voltage)
    assert not m.current.rest.any()


@pytest.mark.parametrize("rest", [1, 2, 5, 11, 300])
def test_the_length_of_the_rest_does_not_matter(rest: int) -> None:
    m = ready(step_table(rest=rest))
    assert m.onset == rest * 0.5
    assert m.step == 4.0


def test_a_jump_through_one_intermediate_sample_starts_there() -> None:
    table = step_table()
    voltage = table.columns["voltage"].copy()
    voltage[30] = 1.7  # the instrument averaged over the step
    m = ready(with_voltage(table, voltage))
    assert 14.5 <= m.onset <= 15.0
    assert m.drive.value([1.0, 40.0]) == pytest.approx([4.0, 4.0])
    assert m.drive.values.max() <= 4.0
    assert m.drive.values.min() >= 0.0


def test_a_quantised_voltage_is_one_level() -> None:
    table, random = step_table(samples=400), np.random.default_rng(1)
    voltage = np.round((table.columns["voltage"] + 1e-3 * random.standard_normal(430)) / 1e-3) * 1e-3
    m = ready(with_voltage(table, voltage))
    assert m.onset == 15.0
    assert m.step == pytest.approx(4.0, abs=2e-4)
    assert np.abs(m.drive.value(m.current.time[~m.current.rest]) - 4.0).max() < 5e-3


def test_noise_on_the_voltage_does_not_move_the_onset() -> None:
    table, random = step_table(samples=400), np.random.default_rng(2)
    m = ready(with_voltage(table, table.columns["voltage"] + 5e-3 * random.standard_normal(430)))
    assert m.onset == 15.0
    assert m.step is not None
    assert np.abs(m.drive.value(m.current.time[~m.current.rest]) - 4.0).max() < 0.025
    assert "voltage-noise-averaged" in codes(m.notes)


@pytest.mark.parametrize("offset", [-0.05, 0.01, 0.1])
def test_an_offset_at_rest_is_still_rest(offset: float) -> None:
    table = step_table()
    m = ready(with_voltage(table, table.columns["voltage"] + offset))
    assert m.onset == 15.0
    assert m.step == pytest.approx(4.0 + offset)


@pytest.mark.parametrize(
    "drive",
    [PiecewiseLinear.ramp(4 / 300, 300.0), Sine(4.0, 0.002), Sine(-2.0, 0.01)],
    ids=["ramp", "slow sine", "sine"],
)
@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_slow_waveform_after_rest_begins_where_it_leaves_the_noise(drive: PiecewiseLinear, noise: float) -> None:
    m = record(drive, 300.0, 601, rest=40, voltage_noise=noise, seed=3).measurement()
    assert m.onset == pytest.approx(20.0, abs=0.5 if not noise else 2.0)
    assert m.step is None
    t = m.current.time[~m.current.rest]
    largest = np.abs(drive.value(t)).max()
    assert np.abs(m.drive.value(t) - drive.value(t + (m.onset - 20.0))).max() < 0.005 * largest + 5 * noise


def test_a_square_wave_keeps_its_edges() -> None:
    drive = PiecewiseLinear.square(-2.0, 4.0, 60.0, 300.0)
    m = record(drive, 300.0, 601, rest=20).measurement()
    assert m.onset == 10.0
    assert m.step is None
    edges = np.unique(m.drive.times[1:][np.diff(m.drive.times) == 0])
    assert edges == pytest.approx(np.arange(30.0, 301.0, 30.0))
    assert m.drive.value([29.9, 30.0, 59.9, 60.0]) == pytest.approx([4.0, -2.0, -2.0, 4.0])


def test_a_pulse_and_a_staircase_are_no_single_step() -> None:
    table = step_table(samples=300)
    since = table.time - 15.0
    for levels in ((4.0, 0.0), (2.0, 4.0), (4.0, -4.0)):
        voltage = np.where(since < 0, 0.0, np.where(since < 60.0, *levels))
        jumps = zip((0.0, 60.0), (levels[0], levels[1] - levels[0]), strict=True)
        after = [(np.maximum(since - at, 0), (since >= at) * jump) for at, jump in jumps]
        current = sum(jump * (0.0015 + 0.05 * np.exp(-t / 7)) for t, jump in after)
        m = ready(Table({**table.columns, "voltage": voltage, "current": current}, "step.csv"))
        assert m.onset == 15.0
        assert m.step is None
        assert m.drive.value([59.9, 60.0]) == pytest.approx(levels)


def test_a_smooth_waveform_is_followed_with_few_points() -> None:
    m = record(PiecewiseLinear.ramp(4 / 300, 300.0), 300.0, 3001, rest=40).measurement()
    assert len(m.drive.times) <= 5


# -- channels ----------------------------------------------------------------------------------------------------------


def test_clipped_current_is_left_out_and_said() -> None:
    table = step_table()
    current = np.minimum(table.columns["current"], 0.12)
    clipped = int((current == 0.12).sum())
    assert clipped > 3
    m = ready(Table({**table.columns, "current": current}, "step.csv"))
    assert len(m.current.values) == len(current) - clipped
    assert m.current.values.max() < 0.12
    (note,) = (str(n) for n in m.notes if n.code == "current-clipped")
    assert "120 mA" in note
    assert f"{clipped} samples" in note


def test_negative_current_is_clipped_alike_and_a_peak_is_not() -> None:
    table = step_table(voltage=-4.0)
    current = np.maximum(table.columns["current"], -0.12)
    m = ready(Table({**table.columns, "current": current}, "step.csv"))
    assert "current-clipped" in codes(m.notes)
    assert "current-clipped" not in codes(ready(table).notes)


def test_a_steady_end_that_is_not_the_peak_is_not_clipping() -> None:
    table = step_table(samples=400)
    current = np.maximum(table.columns["current"], 0.0062) * (table.columns["voltage"] > 0)
    m = ready(Table({**table.columns, "current": current}, "step.csv"))
    assert len(m.current.values) == len(current)


def test_blanks_are_gaps_in_their_own_column_only() -> None:
    r = record(step(), 100.0, 201, rest=20, displacement=True, noise=1e-3)
    columns = {k: v.copy() for k, v in r.columns.items()}
    columns["current"][50:60] = np.nan
    columns["displacement"][::3] = np.nan
    columns["voltage"][100:150] = np.nan
    m = r.changed(**columns).measurement()
    assert (m.onset, m.step) == (10.0, 4.0)
    assert len(m.current.values) == 221 - 10
    assert m.displacement is not None
    assert len(m.displacement.values) == 221 - 74
    assert np.isfinite(m.current.values).all()
    assert np.isfinite(m.displacement.values).all()


def test_without_a_displacement_column_there_is_no_displacement() -> None:
    assert ready(step_table()).displacement is None
    empty = {**step_table().columns, "displacement": np.full(130, np.nan)}
    assert ready(Table(empty)).displacement is None


def test_few_displacement_samples_are_not_fitted_and_said() -> None:
    displacement = np.full(130, np.nan)
    displacement[20:45] = 1e-3
    m = ready(Table({**step_table().columns, "displacement": displacement}))
    assert m.displacement is None
    assert "fewer than 20 displacement samples after the onset: no displacement fit" in map(str, m.notes)


def test_columns_that_are_not_understood_are_named(tmp_path: Path) -> None:
    table = step_table()
    rows = ["time_s,voltage_V,current_mA,temperature_C,remark"]
    rows += [f"{t},{u},{1e3 * i},21.5,ok" for t, u, i in zip(*table.columns.values(), strict=True)]
    path = tmp_path / "data.csv"
    path.write_text("\n".join(rows))
    m = read_record(path)
    assert m.source == "data.csv"
    assert m.current.values == pytest.approx(table.columns["current"], rel=1e-12)
    assert "columns not understood and left out: temperature_C, remark" in map(str, m.notes)


# -- refusals ----------------------------------------------------------------------------------------------------------


def test_no_voltage_at_all() -> None:
    table = step_table()
    with pytest.raises(InputError, match="voltage is zero throughout"):
        ready(with_voltage(table, np.zeros(130)))


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_constant_voltage_with_a_constant_current_holds_no_step(noise: float) -> None:
    random = np.random.default_rng(0)
    columns = {"time": np.arange(200.0), "voltage": np.full(200, 4.0)}
    with pytest.raises(InputError, match="no step in the record"):
        ready(Table({**columns, "current": 0.006 + noise * random.standard_normal(200)}))


def test_a_record_cut_off_at_its_steady_end_holds_no_step() -> None:
    late = record(step(), 300.0, 601, noise=1e-3).rows(slice(400, None))
    with pytest.raises(InputError, match="no step in the record"):
        late.measurement()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("time_s,current_A\n0,1\n1,2\n", "no column for voltage"),
        ("time_s,voltage_V\n0,1\n1,2\n", "no column for current"),
        ("voltage_V,current_A\n0,1\n1,2\n", "no column for time"),
        ("time_s,voltage_V,current_A\n0,,1\n1,4,2\n", "fewer than two numbers"),
        ("time_s,voltage_V,current_A\n0,0,\n1,4,\n", "current column has no number"),
        ("time_s,voltage_V,current_A\n0,0,0\n1,4,0.2\n2,4,0.1\n", "samples after the onset at 0 s; 10 are needed"),
    ],
)
def test_files_that_hold_too_little(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        read_record(path)
    assert str(caught.value).startswith("data.csv: ")


def test_too_few_samples_after_the_onset() -> None:
    with pytest.raises(InputError, match=r"9 current samples after the onset at 15 s; 10 are needed"):
        ready(step_table(samples=9))
    assert ready(step_table(samples=10)).duration == 4.5


# -- helpers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1e-9, 1e-3, 10.0])
def test_noise_level_sees_the_noise_through_a_smooth_signal(size: float) -> None:
    t = np.linspace(0, 300, 3001)
    signal = 100 * size * np.exp(-t / 10)
    noise = size * np.random.default_rng(5).standard_normal(len(t))
    assert noise_level(signal + noise) == pytest.approx(size, rel=0.1)
    assert noise_level(signal) < 1e-3 * size
    assert noise_level(noise[:15]) == 0.0


def test_noise_level_of_a_coarse_resolution_is_not_zero() -> None:
    rounded = np.round(np.random.default_rng(5).standard_normal(3000) * 0.2)
    assert noise_level(rounded) > 0


def test_simplified_stays_within_its_tolerance() -> None:
    t = np.sort(np.random.default_rng(6).uniform(0, 10, 400))
    u = np.sin(t) + 0.1 * np.sin(17 * t)
    for tolerance in (1e-3, 1e-2, 0.1):
        kept = simplified(t, u, tolerance)
        assert kept[0] == 0
        assert kept[-1] == len(t) - 1
        assert np.abs(np.interp(t, t[kept], u[kept]) - u).max() <= tolerance
    assert len(simplified(t, 2 * t, 1e-9)) == 2


# -- between samples ---------------------------------------------------------------------------------------------------


@given(
    st.lists(st.floats(-2, 2), min_size=4, max_size=4),
    st.lists(st.floats(0.5, 1.5), min_size=6, max_size=20),
    st.floats(1e-3, 1e3),
)
def test_a_cubic_is_followed_exactly(coefficients: list[float], steps: list[float], unit: float) -> None:
    t = np.cumsum([0.0, *steps])
    cubic = np.polynomial.Polynomial(coefficients)
    fine_times, fine = between_samples(t * unit, cubic(t), 0.0)
    assert (np.diff(fine_times) > 0).all()
    assert set(t * unit) <= set(fine_times)
    size = np.abs(cubic(t)).max() + np.abs(coefficients).max()
    assert fine == pytest.approx(cubic(fine_times / unit), abs=1e-10 * size * len(t) ** 3)


@pytest.mark.parametrize(("readings", "error"), [(11.3, 2e-4), (20.7, 1e-5)])
def test_a_sine_of_few_readings_a_cycle_is_followed(readings: float, error: float) -> None:
    """A cubic through four of eleven readings a cycle misses by 0.25 % of the amplitude."""
    t = np.arange(100.0)
    rate = 2 * np.pi / readings
    times, values = between_samples(t, np.sin(rate * t), 1e-6)
    inner = (times > 4) & (times < 95)
    assert inner.sum() > 1000
    assert values[inner] == pytest.approx(np.sin(rate * times[inner]), abs=error)


def test_corners_and_noise_are_left_as_they_are() -> None:
    t = np.linspace(0, 12, 49)
    triangle = 1 - np.abs(t % 6 - 3)
    noisy = triangle + np.random.default_rng(3).normal(0, 1e-3, len(t))
    for u, tolerance in ((triangle, 1e-12), (noisy, 3e-3)):
        fine_times, fine = between_samples(t, u, tolerance)
        assert fine_times.tolist() == t.tolist()
        assert fine.tolist() == u.tolist()


@pytest.mark.parametrize(("frequency", "interval"), [(0.01, 0.1), (0.01, 1.0), (0.02, 0.5)])
def test_a_coarsely_sampled_sine_gives_the_true_elements(frequency: float, interval: float) -> None:
    """Straight lines between these samples would move Rdc by up to seven of its standard errors."""
    t = np.arange(0, 300, interval)
    response = simulate(PAPER, Sine(2.0, frequency), t, engine="exact")
    noise = np.random.default_rng(20).normal(0, 1e-5, len(t))
    m = ready(
        Table({"time": t, "voltage": response.voltage, "current": response.current + noise}, "sine.csv"),
    )
    assert m.onset == 0.0
    found = identify(m, model="rc", engine="exact")
    truth = lumped_elements(PAPER).port
    for name in ("dc_resistance", "dynamic_resistance", "capacitance"):
        p = found.parameters[name]
        assert p.stderr is not None
        assert abs(p.value - getattr(truth, name)) < 3.5 * p.stderr, name


def test_the_paper_strip_is_what_the_records_are_made_of() -> None:
    """The records of these tests rest on the exact engine; here they meet the closed form."""
    from ilg_circuit.simulation import closed_forms as formulas

    r: Synthetic = record(step(), 300.0, 301, displacement=True)
    lumped, k = lumped_elements(PAPER), PAPER.coupling
    assert k is not None
    t = r.columns["time"]
    constants = formulas.current_constants(lumped.port.dc_resistance, *lumped.port.branches[0])
    assert r.columns["current"] == pytest.approx(4 * formulas.current_step(t, *constants), rel=1e-9)
    moved = formulas.displacement_step(t, k.gain, k.zero, k.damping_ratio, k.natural_frequency, lumped.bending_ratio)
    assert r.columns["displacement"] == pytest.approx(4 * moved, rel=1e-9, abs=1e-12)
