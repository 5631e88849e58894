"""Drives: every form that can be written, every one that cannot, and their values to the right limit."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.drive import NETLIST_RISE, PiecewiseLinear, Sine
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.drives import parse_drive


@st.composite
def waveforms(draw: st.DrawFn) -> PiecewiseLinear:
    """Straight lines with gaps between times from 1 ms up, jumps and repeated times among them."""
    gaps = draw(st.lists(st.sampled_from([0.0, 0.0, 1e-3, 0.1, 1.0, 7.3]), min_size=1, max_size=12))
    start = draw(st.sampled_from([-2.0, 0.0, 0.5]))
    values = draw(st.lists(st.floats(-5, 5), min_size=len(gaps), max_size=len(gaps)))
    return PiecewiseLinear(start + np.cumsum(gaps), np.array(values))


@pytest.mark.parametrize(
    ("text", "times", "values"),
    [
        ("step:4V", [0.0, 5.0], [4.0, 4.0]),
        ("step:-250mV", [0.0, 5.0], [-0.25, -0.25]),
        ("step: 4 V", [0.0], [4.0]),
        ("ramp:1V/s", [0.0, 0.5, 10.0, 20.0], [0.0, 0.5, 10.0, 10.0]),
        ("ramp:-10mV/s", [5.0], [-0.05]),
        ("ramp:1V/min", [6.0], [0.1]),
        ("sine:2V,0.25Hz", [0.0, 1.0, 3.0], [0.0, 2.0, -2.0]),
        ("sine:2V,1mHz", [250.0], [2.0]),
        ("square:4V,2s", [0.0, 0.9, 1.0, 1.9, 2.0, 3.0], [4.0, 4.0, 0.0, 0.0, 4.0, 0.0]),
        ("square:4V,2s,0.25", [0.4, 0.5, 1.9, 2.0, 2.5], [4.0, 0.0, 0.0, 4.0, 0.0]),
        ("square:4V,2s,25%", [0.4, 0.5], [4.0, 0.0]),
        ("square:-4V..4V,2s", [0.0, 1.0, 2.0], [4.0, -4.0, 4.0]),
        ("square: -1V..3V , 2s , 0.5", [0.0, 1.0], [3.0, -1.0]),
        ("square:4V..-4V,2s", [0.0, 1.0], [-4.0, 4.0]),
    ],
)
def test_forms(text: str, times: list[float], values: list[float]) -> None:
    assert parse_drive(text, 10.0).value(times) == pytest.approx(np.array(values), abs=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        *("", "step", "step:", "step:4V,", "step:4V,1s", "STEP:4V", "4V", "ramp:", "sine:2V", "sine:2V,1Hz,3"),
        *("square:4V", "square:4V,1s,0.5,1", "square:,1s", "file:", "sawtooth:1V,1s", "step 4V", ":4V"),
    ],
)
def test_forms_that_are_none_list_those_there_are(text: str) -> None:
    with pytest.raises(InputError, match=re.escape("step:4V, square:4V,30s[,duty]")):
        parse_drive(text, 10.0)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("step:4", "step: '4' has no unit; write it like '4 V'"),
        ("step:4N", "step: unit 'N' does not measure"),
        ("step:nanV", "step: 'nanV' is not a number"),
        ("step:infV", "step: 'infV' is not a number"),
        ("step:1e999V", "not a finite value"),
        ("ramp:1V", "ramp: unit 'V' does not measure"),
        ("sine:2V,0.1", "sine, frequency: '0.1' has no unit"),
        ("sine:2V,0.1rad/s", "ambiguous by 2 pi"),
        ("sine:2V,0Hz", "the frequency must be more than zero"),
        ("sine:2V,-1Hz", "the frequency must be more than zero"),
        ("square:4V,0s", "must be more than zero"),
        ("square:4V,-3s", "must be more than zero"),
        ("square:4V,30", "has no unit"),
        ("square:4V,3s,0", "duty 0 must lie between 0 and 1"),
        ("square:4V,3s,1", "duty 1 must lie between 0 and 1"),
        ("square:4V,3s,-0.5", "duty"),
        ("square:4V,3s,1s", "square, duty"),
        ("square:1V..2V..3V,3s", "square"),
        ("square:..4V,3s", "square"),
        ("square:4V,1us", "shorten the duration"),
        ("square:4V,1e-320s", "period"),
    ],
)
def test_bad_values_are_named(text: str, hint: str) -> None:
    with pytest.raises(InputError, match=re.escape(hint)):
        parse_drive(text, 10.0)


@given(st.text(max_size=30))
def test_garbage_is_refused_as_input(text: str) -> None:
    with pytest.raises(InputError):
        parse_drive(text, 10.0)


@given(st.sampled_from(["step:", "ramp:", "sine:1V,", "square:1V,", "square:1V,1s,"]), st.text(max_size=12))
def test_garbage_after_a_form_is_refused_as_input(form: str, text: str) -> None:
    with suppress(InputError):
        parse_drive(form + text, 10.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("step:4V", "step 4 V"),
        ("ramp:0.5V/s", "ramp 0.5 V/s"),
        ("sine:2V,0.1Hz", "sine 2 V, 100 mHz"),
        ("square:-4V..4V,30s,0.3", "square -4 V..4 V, 30 s, duty 0.3"),
    ],
)
def test_drives_say_what_they_are(text: str, said: str) -> None:
    assert parse_drive(text, 60.0).text == said


# -- files -------------------------------------------------------------------------------------------------------------


def test_a_file_drives_with_straight_lines_between_its_rows(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time_ms,voltage_mV,current_A\n0,0,1\n1000,500,\n3000,,2\n4000,-500,3\n")
    drive = parse_drive(f"file:{path}", 10.0)
    assert drive.value([0, 0.5, 1, 2.5, 4, 9]) == pytest.approx(np.array([0, 0.25, 0.5, 0.0, -0.5, -0.5]))
    assert drive.text == "file drive.csv"
    assert drive.breakpoints(10.0).tolist() == [1.0, 4.0]


def test_a_file_that_starts_later_is_held_and_one_that_starts_earlier_begins_the_run(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time_s,voltage_V\n-1,1\n1,3\n")
    assert parse_drive(f"file:{path}", 5.0).value([0.0, 1.0, 2.0, 5.0]).tolist() == [1.0, 2.0, 3.0, 3.0]
    path.write_text("time_s,voltage_V\n2,1\n3,2\n")
    assert parse_drive(f"file:{path}", 5.0).value([0.0, 2.5]) == pytest.approx(np.array([1.0, 1.5]))


@pytest.mark.parametrize(
    ("content", "hint"),
    [
        ("time_s,current_A\n0,1\n", "no column for voltage"),
        ("time_s,voltage\n0,1\n", "has no unit"),
        ("time_s,voltage_V\n0,\n1,\n", "has no number in it"),
        ("time_s,voltage_V\n0,x\n", "line 2, column 'voltage_V': 'x' is not a number"),
        ("time_s,voltage_V\n1,1\n0,2\n", "line 3: time 0 s goes back from 1 s"),
        ("", "the file is empty"),
    ],
)
def test_a_bad_file_is_named(tmp_path: Path, content: str, hint: str) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(content)
    with pytest.raises(InputError, match=f"drive.csv: .*{hint}"):
        parse_drive(f"file:{path}", 10.0)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.csv.*No such file"):
        parse_drive(f"file:{tmp_path / 'none.csv'}", 10.0)


# -- piecewise linear --------------------------------------------------------------------------------------------------


def test_a_sample_on_a_jump_is_the_right_limit() -> None:
    drive = PiecewiseLinear([0, 1, 1, 2, 2, 2, 3], [0, 1, 5, 5, 9, -1, 0])
    assert drive.value([0.5, 1.0, 2.0, 2.5, 3.0, 4.0]).tolist() == [0.5, 5.0, -1.0, -0.5, 0.0, 0.0]
    assert PiecewiseLinear.step(4.0, at=2.0).value([0, 1.999, 2.0]).tolist() == [0.0, 0.0, 4.0]


@given(waveforms(), st.floats(0, 30))
def test_value_is_the_limit_from_the_right(drive: PiecewiseLinear, t: float) -> None:
    later = np.nextafter(t, np.inf)
    steepest = 2e4  # 10 V in the shortest gap, and some
    assert drive.value(t) == pytest.approx(drive.value(later), abs=steepest * (later - t) + 1e-12)


@given(waveforms())
def test_value_goes_through_its_points(drive: PiecewiseLinear) -> None:
    last = np.append(np.diff(drive.times) > 0, True)
    assert drive.value(drive.times[last]) == pytest.approx(drive.values[last], abs=1e-12)
    assert (np.abs(drive.value(np.linspace(-5, 50, 400))) <= np.abs(drive.values).max() + 1e-12).all()


@given(waveforms(), st.floats(0.1, 40))
def test_breakpoints_ascend_within_the_run(drive: PiecewiseLinear, duration: float) -> None:
    points = drive.breakpoints(duration)
    assert (np.diff(points) > 0).all()
    assert ((points > 0) & (points < duration)).all()
    assert set(drive.times[(drive.times > 0) & (drive.times < duration)]) == set(points)


@given(waveforms(), st.floats(0.1, 40))
def test_jumps_are_the_breakpoints_at_which_the_value_jumps(drive: PiecewiseLinear, duration: float) -> None:
    jumps = drive.jumps(duration)
    assert set(jumps) <= set(drive.breakpoints(duration))
    twice = drive.times[1:][np.diff(drive.times) == 0]
    assert set(jumps) == {t for t in twice if 0 < t < duration}


@given(waveforms(), st.sampled_from([1.0, 5.0, 7.3, 8.4, 20.0, 40.0]), st.sampled_from([1e-9, NETLIST_RISE, 1e-4]))
def test_widened_is_the_drive_but_for_its_rises(drive: PiecewiseLinear, duration: float, rise: float) -> None:
    times, values = drive.widened(duration, rise)
    assert times[0] == 0
    assert times[-1] > duration
    assert (np.diff(times) > 0).all()
    jumps = np.unique(drive.times[1:][np.diff(drive.times) == 0])
    t = np.concatenate([np.linspace(0, duration, 301), drive.times + 2e-4, drive.times - 2e-4])
    t = t[(t >= 0) & (t < duration)]
    t = t[np.abs(t[:, None] - jumps).min(axis=1, initial=np.inf) > rise]
    # a line that begins at a jump begins half a rise later
    gaps, rises = np.diff(drive.times), np.abs(np.diff(drive.values))
    steepest = np.divide(rises, gaps, out=np.zeros_like(gaps), where=gaps > 0).max(initial=0)
    assert np.interp(t, times, values) == pytest.approx(drive.value(t), abs=1e-9 + steepest * rise)


@pytest.mark.parametrize(
    ("drive", "duration"),
    [
        (PiecewiseLinear.step(1.0, at=1e-7), 1.0),  # the rise would begin before the run
        (PiecewiseLinear.square(0, 1, 1e-6, 1e-5), 1e-5),  # rises as long as the pulses
        (PiecewiseLinear.square(0, 1, 10.0, 30.0, duty=1e-8), 30.0),  # a pulse shorter than a rise
        (PiecewiseLinear([0, 1, 1, 1 + 1e-8, 2], [0, 0, 1, 2, 2]), 2.0),  # a bend within a rise
    ],
    ids=["near the start", "short period", "short pulse", "bend near a jump"],
)
def test_widened_ascends_whatever_the_rise(drive: PiecewiseLinear, duration: float) -> None:
    times, _ = drive.widened(duration, NETLIST_RISE)
    assert times[0] == 0
    assert (np.diff(times) > 0).all()


@pytest.mark.parametrize("duration", [45.0, 75.0, 15.0, 30.0, 60.0])
def test_a_run_that_ends_on_an_edge_keeps_its_level_up_to_there(duration: float) -> None:
    drive = parse_drive("square:4V,30s", duration)
    times, values = drive.widened(duration, NETLIST_RISE)
    t = np.linspace(0, duration, 1000, endpoint=False)
    away = np.abs((t + 7.5) % 15 - 7.5) > 1e-5
    assert np.interp(t, times, values)[away] == pytest.approx(drive.value(t)[away], abs=1e-9)


@pytest.mark.parametrize(
    ("times", "values"),
    [([], []), ([0, 1], [1]), ([[0]], [[1]]), ([0, np.nan], [1, 1]), ([0, 1], [1, np.inf]), ([1, 0], [1, 1])],
)
def test_bad_waveforms(times: list[float], values: list[float]) -> None:
    with pytest.raises(InputError):
        PiecewiseLinear(np.array(times), np.array(values))


# -- square waves ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("duty", [0.1, 0.25, 0.5, 0.9])
@pytest.mark.parametrize("period", [1.0, 30.0])
def test_square_wave_keeps_its_duty(period: float, duty: float) -> None:
    drive = PiecewiseLinear.square(-1.0, 3.0, period, 10 * period, duty)
    t = (np.arange(10000) + 0.5) / 10000 * 10 * period
    assert np.mean(drive.value(t) == 3.0) == pytest.approx(duty, abs=1e-3)
    assert set(drive.value(t)) == {-1.0, 3.0}
    assert len(drive.breakpoints(10 * period)) == 19


@pytest.mark.parametrize("period", [0.1, 0.3, 0.7, 1.1, 0.017, 30.0])
@pytest.mark.parametrize("duty", [0.1, 0.25, 0.5])
def test_samples_on_the_edges_of_a_square_wave_are_right_limits(period: float, duty: float) -> None:
    """Also where an edge and a sample that mean the same time differ in the last bit."""
    drive = parse_drive(f"square:4V,{period}s,{duty}", 20 * period)
    samples = np.linspace(0, 20 * period, 401)[:-1]
    high = np.arange(400) % 20 < round(20 * duty)
    assert (drive.value(samples) == np.where(high, 4.0, 0.0)).all()


def test_a_square_wave_does_not_depend_on_the_runs_length() -> None:
    times = [0.0, 30.0, 59.9, 60.0]
    short, long = (parse_drive("square:4V,30s", d).value(times) for d in (60.0, 600.0))
    assert short.tolist() == long.tolist()


# -- sine --------------------------------------------------------------------------------------------------------------


def test_sine() -> None:
    drive = Sine(2.0, 0.5)
    assert drive.angular_frequency() == pytest.approx(np.pi)
    assert not len(drive.breakpoints(100.0))
    assert not len(drive.jumps(100.0))
    assert drive.spice(10.0) == "SIN(0.0 2.0 0.5)"


@pytest.mark.parametrize(("amplitude", "frequency"), [(np.nan, 1.0), (1.0, np.inf), (1.0, 0.0), (1.0, -2.0)])
def test_bad_sines(amplitude: float, frequency: float) -> None:
    with pytest.raises(InputError, match="frequency"):
        Sine(amplitude, frequency)


# -- text for SPICE ----------------------------------------------------------------------------------------------------


@given(waveforms())
def test_pwl_text_holds_the_widened_waveform(drive: PiecewiseLinear) -> None:
    times, values = drive.widened(20.0, NETLIST_RISE)
    numbers = [float(x) for x in drive.spice(20.0).removeprefix("PWL(").removesuffix(")").split()]
    assert numbers[::2] == times.tolist()
    assert numbers[1::2] == values.tolist()
