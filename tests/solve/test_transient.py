"""ngspice, the exact solver and the closed forms must say the same, whatever the strip, the drive and the time scale.

Differences are relative to the largest value of a waveform, unless said otherwise.
"""

from __future__ import annotations

from dataclasses import replace

import analytic
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from strategies import log_floats
from strategies import strips as random_strips

from ilg_circuit.circuit import Element, Load, Netlist, Output, electrical_netlist, strip_netlist
from ilg_circuit.drive import Drive, PiecewiseLinear
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve import Waveforms, transient
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]

AGREEMENT = 1e-7

DRIVES = {
    "step": "step:4V",
    "square": "square:4V,30s",
    "both signs": "square:-4V..4V,23s,0.3",
    "slow sine": "sine:2V,2mHz",
    "sine": "sine:2V,0.1Hz",
    "fast sine": "sine:1V,1.7Hz",
    "ramp": "ramp:20mV/s",
}


def largest_difference(found: Waveforms, expected: Waveforms) -> float:
    """Of all waveforms, each relative to its largest value; one that should be zero must be."""
    difference = np.abs(found.values - expected.values).max(axis=2)
    scale = np.abs(expected.values).max(axis=2)
    assert not difference[scale == 0].any()
    return float((difference[scale > 0] / scale[scale > 0]).max())


def assert_engines_agree(net: Netlist, drive: Drive, times: Array, tolerance: float = AGREEMENT) -> Waveforms:
    solved = transient(net, drive, times)
    assert solved.engine == "ngspice"
    assert solved.errors.max() <= 1e-7
    assert largest_difference(solved, transient(net, drive, times, engine="exact")) <= tolerance
    return solved


def material(**changes: float) -> Actuator:
    return replace(PAPER, material=replace(PAPER.material, **changes))


def geometry(**changes: float) -> Actuator:
    return replace(PAPER, geometry=replace(PAPER.geometry, **changes))


# -- every drive, beam and tip -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
@pytest.mark.parametrize("beam", ["dynamic", "static"])
@pytest.mark.parametrize("tip", ["free", "clamped"])
def test_engines_and_closed_forms_agree(drive: str, beam: str, tip: str) -> None:
    t = np.linspace(0, 100, 197)
    source = parse_drive(drive, 100.0)
    waves = assert_engines_agree(strip_netlist(PAPER, tip=tip, beam=beam), source, t)
    expected = {"current": analytic.current(PAPER, source, t), "charge": analytic.charge(PAPER, source, t)}
    free = analytic.displacement(PAPER, source, t)
    if tip == "clamped":
        expected["force"] = free * lumped_elements(PAPER).stiffness
    elif beam == "static":
        expected["displacement"] = free
    for name, values in expected.items():
        # the dynamic beam's reflection on the paper's strip is 1e-10
        assert waves.output(name) == pytest.approx(values, abs=AGREEMENT * np.abs(values).max()), name


@pytest.mark.parametrize("beam", ["dynamic", "static"])
def test_step_current_is_good_at_its_own_value(beam: str) -> None:
    """It decays to a thirty-fifth: relative to the maximum alone the tail would count for nothing."""
    t = np.unique(np.concatenate([np.geomspace(0.1, 300, 200), np.linspace(0.1, 300, 301)]))
    waves = transient(strip_netlist(PAPER, beam=beam), parse_drive("step:4V", 300.0), t)
    expected = analytic.current(PAPER, parse_drive("step:4V", 300.0), t)
    assert waves.output("current") == pytest.approx(expected, rel=1e-5, abs=0)


@pytest.mark.parametrize("which", ["electrodes", "rc2", "rc2 electrodes", "load inside", "undamped", "no coupling"])
@pytest.mark.parametrize("drive", ["step:4V", "square:-4V..4V,23s,0.3", "sine:1V,0.3Hz"])
def test_every_topology(strips: dict[str, Actuator], which: str, drive: str) -> None:
    assert_engines_agree(strip_netlist(strips[which]), parse_drive(drive, 100.0), np.linspace(0, 100, 211))


@pytest.mark.parametrize(
    "load", [Load(mass=1e-3), Load(stiffness=1e-3), Load(damping=1e-3), Load(mass=1e-5, stiffness=1e-5, damping=1e-6)]
)
def test_loads(load: Load) -> None:
    waves = assert_engines_agree(
        strip_netlist(PAPER, load=load), parse_drive("step:4V", 100.0), np.linspace(0, 100, 211)
    )
    if load.stiffness and not load.damping:  # at rest the spring carries what the strip pushes
        force, moved = waves.output("force")[-1], waves.output("displacement")[-1]
        assert force == pytest.approx(load.stiffness * moved, rel=1e-6)


# -- any strip ---------------------------------------------------------------------------------------------------------


@settings(max_examples=20)
@given(
    strip=random_strips(),
    drive=st.sampled_from([d for name, d in DRIVES.items() if name != "fast sine"]),
    tip=st.sampled_from(["free", "clamped"]),
    duration=log_floats(10.0, 300.0),
)
def test_random_strips(strip: Actuator, drive: str, tip: str, duration: float) -> None:
    assert_engines_agree(strip_netlist(strip, tip=tip), parse_drive(drive, duration), np.linspace(0, duration, 97))


@pytest.mark.parametrize("drive", ["step:4V", "square:4V,30s", "sine:1V,0.1Hz"])
@pytest.mark.parametrize("modulus", [1e3, 1e5, 1e6, 1e7, 1e8, 1e9])
def test_soft_and_stiff_strips(modulus: float, drive: str) -> None:
    """A modulus of 1 GPa puts five decades between the tip's resonance and the coupling."""
    strip = material(youngs_modulus=modulus)
    assert_engines_agree(strip_netlist(strip), parse_drive(drive, 100.0), np.linspace(0, 100, 97))


@pytest.mark.parametrize("drive", ["step:4V", "square:4V,30s"])
@pytest.mark.parametrize("duration", [1e3, 1e4])
def test_long_runs_of_a_stiff_strip(drive: str, duration: float) -> None:
    period = duration / 4
    source = parse_drive(drive.replace("30s", f"{period}s"), duration)
    assert_engines_agree(strip_netlist(material(youngs_modulus=1e6)), source, np.linspace(0, duration, 97))


@pytest.mark.parametrize("thickness", [5e-6, 50e-6, 2e-3, 5e-3])
@pytest.mark.parametrize("tip", ["free", "clamped"])
def test_thin_and_thick_strips(thickness: float, tip: str) -> None:
    net = strip_netlist(geometry(thickness=thickness), tip=tip)
    assert_engines_agree(net, parse_drive("step:4V", 100.0), np.linspace(0, 100, 97))


@pytest.mark.parametrize("factor", [1e-5, 1e-2, 1e2, 1e5])
@pytest.mark.parametrize("drive", ["step:4V", "square:4V,30s"])
def test_currents_from_microamperes_to_kiloamperes(factor: float, drive: str) -> None:
    m = PAPER.material
    strip = material(
        dc_resistivity=m.dc_resistivity / factor,
        dynamic_resistivity=m.dynamic_resistivity / factor,
        permittivity=m.permittivity * factor,
    )
    t = np.linspace(0, 100, 97)
    waves = assert_engines_agree(strip_netlist(strip), parse_drive(drive, 100.0), t)
    paper = transient(strip_netlist(PAPER), parse_drive(drive, 100.0), t)
    expected = factor * paper.output("current")
    assert waves.output("current") == pytest.approx(expected, abs=AGREEMENT * np.abs(expected).max())


@pytest.mark.parametrize("volts", [1e-9, 1e-3, 1e3])
def test_the_circuit_is_linear(volts: float) -> None:
    t = np.linspace(0, 100, 97)
    net = strip_netlist(PAPER)
    small, one = (transient(net, PiecewiseLinear.step(v), t) for v in (volts, 1.0))
    assert small.values / volts == pytest.approx(one.values, abs=1e-9)


@pytest.mark.parametrize("damping", [0.0, 1e-3, 0.05, 1.0, 20.0])
def test_beams_that_ring_and_beams_that_creep(damping: float) -> None:
    strip = material(beam_damping_ratio=damping)
    assert_engines_agree(strip_netlist(strip), parse_drive("step:4V", 100.0), np.linspace(0, 100, 211))


# -- any time scale ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6])
@pytest.mark.parametrize("drive", ["step:4V", "square:-4V..4V,{}s", "sine:4V,{}Hz", "ramp:1V/s"])
def test_ports_from_microseconds_to_weeks(scale: float, drive: str) -> None:
    number = 3 * scale if "square" in drive else 1 / scale
    source = parse_drive(drive.format(number), 10 * scale)
    net = electrical_netlist(666.0, ((20.0, scale / 20.0),), 5.0)
    assert_engines_agree(net, source, np.linspace(0, 10 * scale, 99))


@pytest.mark.parametrize("scale", [1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e6])
@pytest.mark.parametrize("drive", ["step:4V", "square:4V,{}s"])
@pytest.mark.parametrize("tip", ["free", "clamped"])
def test_strips_from_microseconds_to_weeks(scale: float, drive: str, tip: str) -> None:
    """The paper's strip with every time constant multiplied: its waveforms are the paper's, slower or faster.

    The coupling grows with the root of the scale, so that the reflected impedance keeps its share of Zp.
    """
    k = PAPER.coupling
    assert k is not None
    strip = replace(
        material(permittivity=scale, density=1250.0 * scale**2),
        coupling=replace(
            k, gain=k.gain / scale**0.5, zero=k.zero / scale, natural_frequency=k.natural_frequency / scale
        ),
    )
    source = parse_drive(drive.format(30 * scale), 100 * scale)
    assert_engines_agree(strip_netlist(strip, tip=tip), source, np.linspace(0, 100 * scale, 99))


@pytest.mark.parametrize("duration", [1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1e4, 1e6])
@pytest.mark.parametrize("beam", ["dynamic", "static"])
def test_runs_much_shorter_or_longer_than_the_time_constants(duration: float, beam: str) -> None:
    """In the first instants the tip moves with t cubed; that its path is then all rounding must not fail the rest."""
    t = np.linspace(0, duration, 51)
    source = parse_drive("step:4V", duration)
    waves = transient(strip_netlist(PAPER, beam=beam), source, t)
    current, charge = analytic.current(PAPER, source, t), analytic.charge(PAPER, source, t)
    assert waves.output("current") == pytest.approx(current, abs=AGREEMENT * current.max())
    assert waves.output("charge") == pytest.approx(charge, abs=AGREEMENT * charge.max() + 1e-12)
    free = analytic.displacement(PAPER, source, t)
    assert (np.abs(waves.output("displacement")) <= 1.1 * free + AGREEMENT * free.max()).all()


# -- drives of a laboratory --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [1e-3, 0.1, 1.0])
def test_a_measured_drive_of_a_thousand_points(noise: float) -> None:
    """Evenly spaced, as a logger writes; the exact solver needs one exponential for every width of interval."""
    random = np.random.default_rng(1)
    drive = PiecewiseLinear(np.arange(1000) * 0.1, 1.0 + noise * random.standard_normal(1000))
    assert_engines_agree(strip_netlist(PAPER), drive, np.arange(0, 100, 0.25))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_measured_drive_sampled_at_its_own_times(seed: int) -> None:
    random = np.random.default_rng(seed)
    times = np.sort(random.uniform(0, 100, 60))
    times[0] = 0
    drive = PiecewiseLinear(times, 1.0 + 0.1 * random.standard_normal(60))
    t = drive.times
    waves = assert_engines_agree(electrical_netlist(666.0, ((20.0, 0.35),)), drive, t)
    expected = analytic.superposed(drive, t, "current", *formulas.current_constants(666.0, 20.0, 0.35))
    assert waves.output("current") == pytest.approx(expected, abs=AGREEMENT * np.abs(expected).max())


@pytest.mark.parametrize("drive", ["square:4V,0.1s", "square:4V,0.1s,0.001", "sine:4V,10Hz"])
def test_drives_faster_than_the_strip(drive: str) -> None:
    assert_engines_agree(strip_netlist(PAPER), parse_drive(drive, 10.0), np.linspace(0, 10, 997))


NARROW = {
    "PWM at 50 kHz": (parse_drive("square:4V,20us", 2e-3), 2e-3),
    "PWM at 1 MHz": (parse_drive("square:4V,1us,0.3", 1e-4), 1e-4),
    "short duty": (parse_drive("square:4V,1s,1e-5", 5.0), 5.0),
    "pulse of 10 us": (PiecewiseLinear([0, 10, 10, 10 + 1e-5, 10 + 1e-5], [0, 0, 4, 4, 0]), 100.0),
    "pulse of 10 ns": (PiecewiseLinear([0, 10, 10, 10 + 1e-8, 10 + 1e-8], [0, 0, 4, 4, 0]), 100.0),
    "bend 10 us after a jump": (PiecewiseLinear([0, 10, 10, 10 + 1e-5, 30], [0, 0, 4, 5, 0]), 100.0),
    "bend 10 ns after a jump": (PiecewiseLinear([0, 10, 10, 10 + 1e-8, 30], [0, 0, 4, 5, 0]), 100.0),
    "step 1 us after the start": (PiecewiseLinear.step(4.0, at=1e-6), 100.0),
    "step 1 us before the end": (PiecewiseLinear.step(4.0, at=100 - 1e-6), 100.0),
}


@pytest.mark.parametrize(("drive", "duration"), NARROW.values(), ids=NARROW)
def test_edges_however_narrow_are_solved_or_refused(drive: PiecewiseLinear, duration: float) -> None:
    """An edge that a grid cannot hold apart from its neighbour must not be swallowed without a word."""
    t = np.linspace(0, duration, 98)
    for net in (electrical_netlist(666.0, ((20.0, 0.35),)), strip_netlist(PAPER)):
        try:
            found = transient(net, drive, t)
        except SolveError:
            continue
        exact = transient(net, drive, t, engine="exact")
        for name in ("current", "charge"):
            scale = np.abs(exact.output(name)).max()
            assert found.output(name) == pytest.approx(exact.output(name), abs=1e-6 * scale), name


@pytest.mark.parametrize("at", [1e-3, 1.0, 50.0, 99.0])
def test_late_steps(at: float) -> None:
    assert_engines_agree(strip_netlist(PAPER), PiecewiseLinear.step(4.0, at=at), np.linspace(0, 100, 97))


@pytest.mark.parametrize("seed", range(5))
def test_any_length_of_run_is_solved(seed: int) -> None:
    """Among ends with all their digits some are met a rounding error too early."""
    net = electrical_netlist(666.0, ((20.0, 0.35),))
    constants = formulas.current_constants(666.0, 20.0, 0.35)
    for duration in 10 ** np.random.default_rng(seed).uniform(0, 3, 10):
        t = np.linspace(0, duration, 31)
        found = transient(net, parse_drive("step:1V", duration), t).output("current")
        assert found == pytest.approx(formulas.current_step(t, *constants), abs=1e-8)


@pytest.mark.parametrize("frequency", [1.7, 7 / 3])
def test_a_sine_keeps_its_frequency_over_many_cycles(frequency: float) -> None:
    """ngspice keeps eleven digits of a number in an expression: 2 pi f must not be one of them."""
    drive, t = parse_drive(f"sine:1V,{frequency!r}Hz", 300.0), np.append(0.0, np.linspace(299, 300, 41))
    net = electrical_netlist(666.0, ((20.0, 0.35),))
    found = transient(net, drive, t, accuracy=1e-6).output("current")
    expected = analytic.superposed(drive, t, "current", *formulas.current_constants(666.0, 20.0, 0.35))
    assert found == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


# -- samples -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
@pytest.mark.parametrize("duration", [45.0, 75.0, 80.0])
def test_samples_on_edges_are_right_limits(engine: str, duration: float) -> None:
    """Also where the run ends on an edge (45 s, 75 s)."""
    net = electrical_netlist(600.0, ((20.0, 0.1),))
    drive = parse_drive("square:4V,30s", duration)
    edges = np.arange(0, duration + 1, 15.0)
    found = transient(net, drive, edges, engine=engine).output("current")
    left = transient(net, drive, np.append(edges[1:] - 1e-9, duration), engine="exact").output("charge")[:-1] / 0.1
    voltage = np.where(np.arange(len(edges)) % 2, 0.0, 4.0)
    expected = voltage / 600 + (voltage - np.insert(left, 0, 0.0)) / 20
    assert found == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_the_end_of_a_run_is_as_good_as_its_middle(engine: str) -> None:
    """A run that stops on an edge has the same past as one that goes on."""
    t = np.arange(0, 45.5, 0.5)
    net = strip_netlist(PAPER)
    short = transient(net, parse_drive("square:4V,30s", 45.0), t, engine=engine)
    long = transient(net, parse_drive("square:4V,30s", 90.0), np.arange(0, 90.5, 0.5), engine=engine)
    before = len(t) - 1
    scale = np.abs(long.values).max(axis=2, keepdims=True) + 1e-300
    assert (np.abs(short.values - long.values[:, :, : len(t)])[..., :before] <= AGREEMENT * scale).all()


@pytest.mark.parametrize("period", [0.1, 0.3, 0.7, 1.1])
def test_engines_agree_on_samples_that_all_but_hit_an_edge(period: float) -> None:
    """An edge at 3*0.1 s and a sample at 0.3 s differ in the last bit and mean the same."""
    drive = parse_drive(f"square:4V,{period}s", 10 * period)
    assert_engines_agree(electrical_netlist(666.0, ((20.0, 0.35),)), drive, np.linspace(0, 10 * period, 201))


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
@pytest.mark.parametrize("times", [[0.0], [0.0, 100.0], [0.0, 1e-6, 50.0]])
def test_the_sample_at_zero_is_the_right_limit(engine: str, times: list[float]) -> None:
    waves = transient(strip_netlist(PAPER), parse_drive("step:4V", 100.0), times, engine=engine)
    assert waves.output("current")[0] == pytest.approx(0.2118, rel=1e-7)
    assert waves.output("charge")[0] == pytest.approx(0.0, abs=1e-7 * 1.4)
    assert waves.output("displacement")[0] == pytest.approx(0.0, abs=1e-7 * 4e-3)


@pytest.mark.parametrize("times", [[7.0], [99.9, 100.0], [1e-3], [1e-3, 1.0, 1.0 + 1e-6, 60.0]])
def test_few_and_irregular_samples(times: list[float]) -> None:
    net, drive = electrical_netlist(666.0, ((20.0, 0.35),)), parse_drive("step:4V", 100.0)
    found = transient(net, drive, times).output("current")
    expected = 4 * formulas.current_step(times, *formulas.current_constants(666.0, 20.0, 0.35))
    assert found == pytest.approx(expected, abs=AGREEMENT * 0.2)


@pytest.mark.parametrize("drive", ["step:4V", "square:4V,30s", "sine:2V,0.1Hz"])
def test_irregular_samples(drive: str) -> None:
    t = np.unique(np.concatenate([np.random.default_rng(5).uniform(0, 100, 100), np.geomspace(1e-6, 100, 20)]))
    assert_engines_agree(strip_netlist(PAPER), parse_drive(drive, 100.0), t)


@pytest.mark.parametrize("drive", ["step:4V", "square:4V,30s", "sine:2V,0.1Hz"])
@pytest.mark.parametrize("count", [31, 301, 6001])
def test_interpolated_samples_are_as_good_as_solved_ones(drive: str, count: int) -> None:
    t = np.linspace(0, 95, count)
    net, source = strip_netlist(PAPER), parse_drive(drive, 95.0)
    exact = transient(net, source, t, engine="exact")
    for interpolate in (True, False):
        assert largest_difference(transient(net, source, t, interpolate=interpolate), exact) <= AGREEMENT


# -- accuracy ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("drive", [d for d in DRIVES.values() if d != "square:4V,30s"])
@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-7, 1e-9])
def test_the_accuracy_asked_for_is_kept(drive: str, accuracy: float) -> None:
    t = np.linspace(0, 100, 211)
    net, source = strip_netlist(PAPER), parse_drive(drive, 100.0)
    waves = transient(net, source, t, accuracy=accuracy)
    assert waves.errors.max() <= accuracy
    assert largest_difference(waves, transient(net, source, t, engine="exact")) <= accuracy


@pytest.mark.parametrize("accuracy", [0.0, -1.0, 1e-12, 0.1, float("nan"), float("inf")])
def test_accuracies_that_make_no_sense(accuracy: float) -> None:
    with pytest.raises(InputError, match="must lie between 1e-11 and 1e-2"):
        transient(strip_netlist(PAPER), parse_drive("step:4V", 1.0), [0.0, 1.0], accuracy=accuracy)


def test_unknown_engine_and_no_netlist() -> None:
    with pytest.raises(InputError, match="engine is 'xyce'; choose ngspice or exact"):
        transient(strip_netlist(PAPER), parse_drive("step:4V", 1.0), [0.0, 1.0], engine="xyce")
    with pytest.raises(InputError, match="at least one netlist"):
        transient([], parse_drive("step:4V", 1.0), [0.0, 1.0])


# -- many at once ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_many_at_once_are_each_alone_and_in_order(engine: str) -> None:
    """Time constants over three decades: solved in groups, returned in the order given."""
    moduli = np.random.default_rng(7).permutation(np.geomspace(1e3, 1e9, 9))
    nets = [strip_netlist(material(youngs_modulus=float(e))) for e in moduli]
    drive, t = parse_drive("step:4V", 60.0), np.linspace(0, 60, 61)
    together = transient(nets, drive, t, engine=engine)
    for k, net in enumerate(nets):
        alone = transient(net, drive, t, engine=engine)
        scale = np.abs(alone.values[0]).max(axis=1, keepdims=True) + 1e-300
        assert (np.abs(together.values[k] - alone.values[0]) <= AGREEMENT * scale).all()
        assert together.output("current", k) == pytest.approx(together.values[k, 0], abs=0)


def test_more_than_one_batch() -> None:
    values = np.linspace(10.0, 30.0, 130)
    nets = [electrical_netlist(600.0, ((float(r), 0.3),), 1.0) for r in values]
    t = np.linspace(0, 30, 31)
    seen: list[tuple[int, int]] = []
    waves = transient(nets, parse_drive("step:1V", 30.0), t, progress=lambda done, total: seen.append((done, total)))
    for k, r in enumerate(values):
        expected = formulas.current_step(t, *formulas.current_constants(600.0, float(r), 0.3, 1.0))
        assert waves.output("current", k) == pytest.approx(expected, abs=AGREEMENT * expected[0])
    assert len(seen) > 1
    assert seen[-1] == (130, 130)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_only_one_topology_at_once(strips: dict[str, Actuator]) -> None:
    with pytest.raises(InputError, match="one topology"):
        transient(
            [strip_netlist(strips["paper"]), strip_netlist(strips["rc2"])], parse_drive("step:4V", 1.0), [0.0, 1.0]
        )


# -- circuits beside strips --------------------------------------------------------------------------------------------


def test_every_kind_of_element_is_the_same_to_both_engines() -> None:
    elements = (
        Element("Vdrive", ("in", "0"), 0.0),
        Element("R1", ("in", "a"), 2.0),
        Element("L1", ("a", "b"), 0.7),
        Element("C1", ("b", "0"), 0.4),
        Element("Vbias", ("c", "0"), 0.3),
        Element("R2", ("c", "b"), 5.0),
        Element("I1", ("0", "b"), 0.2),
        Element("E1", ("d", "0", "b", "a"), 1.5),
        Element("R3", ("d", "e"), 3.0),
        Element("C2", ("e", "0"), 0.2),
        Element("G1", ("0", "e", "a", "0"), 0.3),
        Element("F1", ("0", "e"), 0.4, "Vbias"),
        Element("H1", ("f", "0"), 0.8, "Vdrive"),
        Element("R4", ("f", "e"), 7.0),
    )
    outputs = (
        Output("current", "A", (("i(Vdrive)", -1.0),)),
        Output("inductor", "A", (("i(L1)", 1.0),)),
        Output("mixed", "V", (("v(e)", 2.0), ("v(b)", -0.5), ("i(Vbias)", 3.0))),
        Output("f", "V", (("v(f)", 1.0),)),
    )
    net = Netlist("all kinds", elements, outputs)
    for drive in ("step:1V", "square:-1V..2V,3s", "sine:1V,0.4Hz"):
        assert_engines_agree(net, parse_drive(drive, 20.0), np.linspace(0, 20, 157))


def test_capital_letters_in_a_netlist_do_not_matter() -> None:
    elements = (
        Element("Vdrive", ("In", "0"), 0.0),
        Element("Rd", ("In", "Mid"), 2.0),
        Element("Ca", ("Mid", "0"), 0.5),
        Element("Hx", ("Out", "0"), 2.0, "VDRIVE"),
        Element("Rx", ("Out", "0"), 2.0),
    )
    net = Netlist("capitals", elements, (Output("x", "V", (("v(Out)", 1.0), ("v(Mid)", 1.0))),))
    assert_engines_agree(net, parse_drive("step:1V", 5.0), np.linspace(0, 5, 31))


@pytest.mark.parametrize("node", ["MID", "gnd"])
def test_nodes_that_spice_takes_for_one_are_one_or_refused(node: str) -> None:
    """ngspice does not tell MID from mid, and gnd is ground to it: the exact solver must not think otherwise."""
    elements = (
        Element("Vdrive", ("in", "0"), 0.0),
        Element("R1", ("in", "mid"), 2.0),
        Element("C1", ("mid", "0"), 0.5),
        Element("R2", (node, "0" if node == "MID" else "in"), 3.0),
        Element("R3", (node, "in" if node == "MID" else "mid"), 3.0),
    )
    try:
        net = Netlist("one node", elements, (Output("current", "A", (("i(Vdrive)", -1.0),)),))
    except InputError:
        return
    assert_engines_agree(net, parse_drive("step:1V", 5.0), np.linspace(0, 5, 31))
