"""From waveforms to a response: energy, tables, files, sample times."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from strategies import log_floats

from ilg_circuit.circuit import Load
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import Response, sample_times, simulate, transient_band
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.ladder import LADDER_BAND

T = np.linspace(0, 100, 101)
HEADER = "time_s,voltage_V,current_A,displacement_m,force_N,charge_C"


@pytest.fixture(scope="module")
def step() -> Response:
    return simulate(PAPER, parse_drive("step:4V", 100.0), T)


# -- what a response holds ---------------------------------------------------------------------------------------------


def test_waveforms_are_at_the_times_asked_for(step: Response) -> None:
    assert (step.time == T).all()
    for name in ("voltage", "current", "displacement", "force", "charge", "energy"):
        assert getattr(step, name).shape == T.shape
        assert np.isfinite(getattr(step, name)).all()
    assert step.engine == "ngspice"
    assert 0 <= step.error <= 1e-9


def test_it_starts_from_rest_at_the_right_limit(step: Response) -> None:
    assert step.voltage[0] == 4.0
    assert step.current[0] == pytest.approx(0.2118, rel=1e-9)
    for name in ("displacement", "charge", "energy"):
        assert abs(getattr(step, name)[0]) <= 1e-9 * np.abs(getattr(step, name)).max()


def test_the_tip_moves_towards_the_anode_at_once(step: Response) -> None:
    """d(s) has relative degree one, but the beam's mass lets the tip only begin with t cubed."""
    assert (step.displacement[1:] > 0).all()
    static = simulate(PAPER, parse_drive("step:4V", 1e-3), [0.0, 1e-3], beam="static")
    k = PAPER.coupling
    assert k is not None
    assert static.displacement[1] / 1e-3 == pytest.approx(4 * 10800 * k.gain, rel=1e-3)


def test_clamped_force_is_stiffness_times_free_displacement() -> None:
    drive = parse_drive("step:4V", 100.0)
    free = simulate(PAPER, drive, T, beam="static")
    clamped = simulate(PAPER, drive, T, beam="static", tip="clamped")
    expected = free.displacement * lumped_elements(PAPER).stiffness
    assert clamped.force == pytest.approx(expected, abs=1e-9 * expected.max())
    assert not clamped.displacement.any()
    assert not free.force.any()


def test_without_coupling_motion_is_not_known(strips: dict[str, Actuator]) -> None:
    response = simulate(strips["no coupling"], parse_drive("step:4V", 100.0), T)
    assert np.isnan(response.displacement).all()
    assert np.isnan(response.force).all()
    assert response.current[0] == pytest.approx(0.2118, rel=1e-9)


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_unsorted_or_negative_times_are_refused(engine: str) -> None:
    for times in ([1.0, 0.5], [-1.0, 1.0], [0.0, 0.0], [0.0, np.nan], []):
        with pytest.raises(InputError):
            simulate(PAPER, parse_drive("step:4V", 1.0), times, engine=engine)


def test_a_single_late_time() -> None:
    response = simulate(PAPER, parse_drive("step:4V", 50.0), [50.0])
    whole = simulate(PAPER, parse_drive("step:4V", 50.0), [0.0, 10.0, 50.0])
    for name in ("current", "displacement", "charge"):
        assert getattr(response, name)[0] == pytest.approx(getattr(whole, name)[-1], rel=1e-8)


@pytest.mark.parametrize(
    ("drive", "duration"), [("sine:1V,100Hz", 0.1), ("sine:1V,1kHz", 0.01), ("step:4V", 1e-3), ("step:4V", 1e-5)]
)
def test_fast_events_are_solved_as_they_come(drive: str, duration: float) -> None:
    """The tip hardly moves then; what is left of its path after rounding must not forbid the current."""
    t = np.linspace(0, duration, 77)
    response = simulate(PAPER, parse_drive(drive, duration), t)
    exact = simulate(PAPER, parse_drive(drive, duration), t, engine="exact")
    assert response.current == pytest.approx(exact.current, abs=1e-7 * np.abs(exact.current).max())


# -- energy ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_energy_of_a_step(beam: str) -> None:
    """U times the integral of i = a0 + a1 exp(-lambda t)."""
    response = simulate(PAPER, parse_drive("step:4V", 100.0), T, beam=beam)
    lumped = lumped_elements(PAPER)
    a0, a1, rate = formulas.current_constants(
        lumped.port.dc_resistance, lumped.port.dynamic_resistance, lumped.port.capacitance
    )
    expected = 16 * (a0 * T + a1 / rate * (1 - np.exp(-rate * T)))
    assert response.energy == pytest.approx(expected, abs=1e-8 * expected.max())


@pytest.mark.parametrize("samples", [1, 2, 5, 101])
@pytest.mark.parametrize("text", ["step:4V", "sine:2V,0.05Hz", "ramp:0.1V/s", "square:-4V..4V,22s"])
def test_energy_needs_no_dense_samples(text: str, samples: int) -> None:
    """It is the integral of u i whatever was sampled, not a sum over the samples."""
    t = np.linspace(0, 60, samples) if samples > 1 else np.array([60.0])
    drive = parse_drive(text, 60.0)
    coarse = simulate(PAPER, drive, t, beam="static", engine="exact")
    fine_times = np.unique(np.concatenate([np.linspace(0, 60, 3001), drive.breakpoints(60.0)]))
    fine = simulate(PAPER, drive, fine_times, beam="static", engine="exact")
    assert coarse.energy[-1] == pytest.approx(fine.energy[-1], rel=1e-6)


def test_energy_of_a_sine_against_quadrature() -> None:
    lumped = lumped_elements(PAPER)
    constants = formulas.current_constants(
        lumped.port.dc_resistance, lumped.port.dynamic_resistance, lumped.port.capacitance
    )
    drive = parse_drive("sine:2V,0.05Hz", 60.0)

    def power(t: float) -> float:
        return float(drive.value(t) * 2 * formulas.current_sine(t, *constants, 0.05))

    expected, _ = quad(power, 0, 60, epsrel=1e-11, limit=400)
    response = simulate(PAPER, drive, np.linspace(0, 60, 241), beam="static")
    assert response.energy[-1] == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("which", ["paper", "electrodes", "no coupling"])
@pytest.mark.parametrize("text", ["step:4V", "square:-4V..4V,23s,0.3", "sine:2V,0.1Hz"])
def test_energy_is_stored_or_lost(strips: dict[str, Actuator], which: str, text: str) -> None:
    """q^2/2 C of the capacitor plus the losses in Re, Rdc and Rd; the motion of these strips takes 1e-10."""
    lumped = lumped_elements(strips[which])
    ((rd, c),) = lumped.port.branches
    t = np.linspace(0, 60, 4001)
    response = simulate(strips[which], parse_drive(text, 60.0), t, engine="exact")
    port = response.voltage - lumped.port.electrode_resistance * response.current
    ionic = response.current - port / lumped.port.dc_resistance
    losses = (
        lumped.port.electrode_resistance * response.current**2 + port**2 / lumped.port.dc_resistance + rd * ionic**2
    )
    lost = np.concatenate([[0.0], np.cumsum((losses[1:] + losses[:-1]) / 2 * np.diff(t))])
    # the trapezoidal sum over samples is what limits this comparison, at the edges most
    assert response.energy == pytest.approx(response.charge**2 / (2 * c) + lost, abs=5e-3 * response.energy.max())


# -- CSV ---------------------------------------------------------------------------------------------------------------


def rows_of(path: Path) -> list[list[str]]:
    with path.open(newline="") as file:
        return list(csv.reader(file))


def test_csv_is_the_contract(step: Response, tmp_path: Path) -> None:
    step.write_csv(tmp_path / "run.csv")
    text = (tmp_path / "run.csv").read_bytes().decode("ascii")
    assert text.startswith(HEADER + "\n")
    assert text.endswith("\n")
    assert "\r" not in text
    header, *rows = rows_of(tmp_path / "run.csv")
    assert header == HEADER.split(",")
    assert len(rows) == len(T)
    columns = [step.time, step.voltage, step.current, step.displacement, step.force, step.charge]
    for k, column in enumerate(columns):
        assert [float(row[k]) for row in rows] == column.tolist()  # every bit


def test_csv_with_energy(step: Response, tmp_path: Path) -> None:
    step.write_csv(tmp_path / "run.csv", energy=True)
    header, *rows = rows_of(tmp_path / "run.csv")
    assert header == [*HEADER.split(","), "energy_J"]
    assert [float(row[-1]) for row in rows] == step.energy.tolist()


def test_csv_has_blanks_for_what_is_not_known(strips: dict[str, Actuator], tmp_path: Path) -> None:
    simulate(strips["no coupling"], parse_drive("step:4V", 1.0), [0.0, 1.0]).write_csv(tmp_path / "run.csv")
    _, *rows = rows_of(tmp_path / "run.csv")
    for row in rows:
        assert row[3] == row[4] == ""
        assert all(row[k] for k in (0, 1, 2, 5))


def test_csv_can_be_a_drive(tmp_path: Path) -> None:
    drive = parse_drive("ramp:0.1V/s", 10.0)
    simulate(PAPER, drive, np.linspace(0, 10, 21), engine="exact").write_csv(tmp_path / "run.csv")
    again = parse_drive(f"file:{tmp_path / 'run.csv'}", 10.0)
    assert again.value([0.0, 3.21, 10.0]) == pytest.approx(drive.value([0.0, 3.21, 10.0]))


def test_csv_to_a_folder_that_is_not_there(step: Response, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        step.write_csv(tmp_path / "none" / "run.csv")


# -- summary -----------------------------------------------------------------------------------------------------------


def test_summary(step: Response) -> None:
    lines = step.summary().splitlines()
    assert [line.split()[0] for line in lines] == [
        "quantity",
        "voltage",
        "current",
        "displacement",
        "force",
        "charge",
        "energy",
    ]
    assert lines[1].split() == ["voltage", "4", "V", "4", "V", "0", "s"]
    assert "4.3" in lines[3]
    assert "mm" in lines[3]


def test_summary_says_what_is_not_known(strips: dict[str, Actuator]) -> None:
    summary = simulate(strips["no coupling"], parse_drive("step:4V", 1.0), [0.0, 1.0]).summary()
    assert summary.count("the actuator has no [coupling]") == 2


def test_summary_finds_the_largest_of_both_signs() -> None:
    response = simulate(PAPER, parse_drive("step:-4V", 100.0), T, engine="exact")
    line = next(line for line in response.summary().splitlines() if line.startswith("voltage"))
    assert line.split()[3:5] == ["-4", "V"]


# -- what goes together ------------------------------------------------------------------------------------------------


def test_a_load_pulls_on_the_strip() -> None:
    response = simulate(PAPER, parse_drive("step:4V", 100.0), T, load=Load(stiffness=1e-4))
    assert response.force[-1] == pytest.approx(1e-4 * response.displacement[-1], rel=1e-6)
    assert 0 < response.displacement[-1] < 4e-3


def test_accuracy_that_cannot_be_reached_is_an_error_not_a_result() -> None:
    white = PiecewiseLinear(np.linspace(0, 1, 200), np.random.default_rng(1).standard_normal(200))
    with pytest.raises(SolveError, match="ask for less accuracy where a command lets you"):
        simulate(PAPER, white, np.linspace(0, 1, 11), accuracy=1e-11)


# -- sample times ------------------------------------------------------------------------------------------------------


def test_default_samples() -> None:
    times = sample_times(300.0)
    assert len(times) == 601
    assert times[0] == 0
    assert times[-1] == 300.0


@pytest.mark.parametrize(
    ("duration", "step", "expected"),
    [
        (1.0, 0.25, [0.0, 0.25, 0.5, 0.75, 1.0]),
        (1.0, 0.3, [0.0, 0.3, 0.6, 0.9, 1.0]),
        (0.3, 0.1, [0.0, 0.1, 0.2, 0.3]),
        (1.0, 1.0, [0.0, 1.0]),
        (1e-3, 4e-4, [0.0, 4e-4, 8e-4, 1e-3]),
    ],
)
def test_steps(duration: float, step: float, expected: list[float]) -> None:
    assert sample_times(duration, step=step) == pytest.approx(np.array(expected), rel=1e-12, abs=1e-18)


@given(log_floats(1e-6, 1e6), log_floats(1e-3, 1.0))
def test_steps_end_at_the_duration(duration: float, part: float) -> None:
    times = sample_times(duration, step=part * duration)
    assert times[0] == 0
    assert times[-1] == pytest.approx(duration, rel=1e-12)
    assert (np.diff(times) > 0).all()
    assert np.diff(times).max() <= part * duration * (1 + 1e-9)
    assert np.diff(times)[:-1] == pytest.approx(part * duration, rel=1e-6)


@given(log_floats(1e-6, 1e6), st.integers(2, 5000))
def test_numbers_of_samples(duration: float, samples: int) -> None:
    times = sample_times(duration, samples=samples)
    assert len(times) == samples
    assert (times[0], times[-1]) == (0.0, duration)


@pytest.mark.parametrize(
    ("duration", "how", "hint"),
    [
        (0.0, {}, "duration 0 s must be more than zero"),
        (-1.0, {}, "duration -1 s must be more than zero"),
        (np.nan, {}, "duration"),
        (np.inf, {}, "duration"),
        (1.0, {"samples": 1}, "1 samples: give 2 to 2000000"),
        (1.0, {"samples": 0}, "give 2 to 2000000"),
        (1.0, {"samples": 3_000_000}, "give 2 to 2000000"),
        (1.0, {"step": 0.0}, "step 0 s must be more than zero"),
        (1.0, {"step": -0.1}, "must be more than zero"),
        (1.0, {"step": 2.0}, "at most the duration 1 s"),
        (1.0, {"step": np.nan}, "step"),
        (1.0, {"step": 1e-9}, "at most 2000000 are possible"),
        (1.0, {"step": 0.1, "samples": 5}, "not both"),
    ],
)
def test_sample_times_that_make_no_grid(duration: float, how: dict[str, float], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        sample_times(duration, **how)


def test_drives_before_the_first_sample_count() -> None:
    late = simulate(PAPER, PiecewiseLinear.step(4.0), [10.0, 20.0], engine="exact")
    whole = simulate(PAPER, PiecewiseLinear.step(4.0), np.linspace(0, 20, 201), engine="exact")
    assert late.charge == pytest.approx(whole.charge[[100, 200]], rel=1e-9)
    assert late.energy == pytest.approx(whole.energy[[100, 200]], rel=1e-6)


def test_the_band_of_a_ladder_follows_from_the_length_of_the_run() -> None:
    """From a tenth of the run's frequency over five decades, however it is sampled."""
    assert transient_band(np.array([0.0])) == LADDER_BAND
    for times in (np.arange(0.0, 601.0), np.array([0.0, 1.0, 1.5, 600.0]), np.array([0.0, 600.0])):
        assert transient_band(times) == pytest.approx((0.1 / 600, 1e4 / 600))
    assert transient_band(np.linspace(0.0, 1e-6, 11)) == pytest.approx((1e5, 1e10))
