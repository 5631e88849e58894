"""ngspice, the exact solver and the closed forms must say the same, whatever the strip, the drive and the time scale.

Differences are relative to the largest value of a waveform, unless said otherwise.
"""

from __future__ import annotations

from dataclasses import replace

import analytic
import numpy as np
import pytest
from engines import AGREEMENT, DRIVES, assert_engines_agree, geometry, material
from every_model import port_of
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from strategies import log_floats
from strategies import strips as random_strips

from ilg_circuit.circuit import Load, electrical_netlist, strip_netlist
from ilg_circuit.circuit.strip import port_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import SolveError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve import transient
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.port import Port
from ilg_circuit.units import PLAUSIBLE

Array = NDArray[np.float64]


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
def test_strips_from_microseconds_to_weeks(scale: float, drive: str, tip: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The paper's strip with every time constant multiplied: its waveforms are the paper's, slower or faster.

    The coupling grows with the root of the scale, so that the reflected impedance keeps its share of Zp.
    """
    monkeypatch.setitem(PLAUSIBLE, "kg/m^3", (1e-12, 1e18))  # no gel, but what so slow or fast a strip has
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


@pytest.mark.parametrize("accuracy", [1e-5, 1e-6, 1e-7])
@pytest.mark.parametrize("model", ["rc3", "warburg"])
def test_diffusion_under_a_sampled_sine_is_as_accurate_as_asked_for(model: str, accuracy: float) -> None:
    """Its corners excite the fast modes of a ladder little, and are given few nodes."""
    knots = np.linspace(0.0, 120.0, 301)
    drive = PiecewiseLinear(knots, 3 * np.sin(2 * np.pi * knots / 23))
    t = np.random.default_rng(0).uniform(0.0, 120.0, 200)
    t.sort()
    run = transient([port_netlist(port_of(model, 0.0))], drive, t, accuracy=accuracy)
    exact = transient([port_netlist(port_of(model, 0.0))], drive, t, engine="exact").output("current")
    assert np.abs(run.output("current") - exact).max() <= accuracy * np.abs(exact).max()


def test_samples_soon_after_a_corner_are_accurate() -> None:
    """A fast mode is hardly excited by it, and felt there all the same: without steps the error stayed 16 times it."""
    port = Port(1e3, ((1e-3, 1e-3), (100.0, 1.0)))
    drive = PiecewiseLinear(np.array([0.0, 50.0, 100.0]), np.array([0.0, 1.0, 0.0]))
    t = np.unique(np.append(np.linspace(0.0, 100.0, 201), 50.0 + np.array([1e-6, 1e-5, 1e-3])))
    run = transient([port_netlist(port)], drive, t, accuracy=1e-6)
    exact = transient([port_netlist(port)], drive, t, engine="exact").output("current")
    assert np.abs(run.output("current") - exact).max() <= 1e-6 * np.abs(exact).max()


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
