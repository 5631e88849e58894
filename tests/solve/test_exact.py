"""The exact solver against closed forms and against integration of the same equations."""

from __future__ import annotations

from itertools import pairwise

import analytic
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from strategies import strips as random_strips

from ilg_circuit.circuit import Element, Netlist, Output, electrical_netlist, strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve import transient
from ilg_circuit.solve.exact import _shared_widths
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.solve.waves import interval_grid
from ilg_circuit.strip.actuator import PAPER, Actuator

DRIVES = {
    "step": "step:4V",
    "negative step": "step:-1.5V",
    "square": "square:4V,30s",
    "duty": "square:4V,30s,0.2",
    "both signs": "square:-4V..4V,22s,0.7",
    "fast square": "square:4V,0.5s",
    "slow sine": "sine:2V,1mHz",
    "sine": "sine:2V,0.1Hz",
    "fast sine": "sine:2V,7Hz",
    "ramp": "ramp:10mV/s",
}
PORTS = {"Re = 0": (666.667, 19.4363, 0.35, 0.0), "Re": (666.667, 19.4363, 0.35, 5.0), "slow": (50.0, 5.0, 1e3, 1.0)}


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
@pytest.mark.parametrize("port", PORTS.values(), ids=PORTS)
def test_port_under_every_drive(drive: str, port: tuple[float, float, float, float]) -> None:
    t = np.linspace(0, 100, 512)  # not a multiple of any period
    dc, r, c, electrode = port
    source = parse_drive(drive, 100.0)
    waves = transient(electrical_netlist(dc, ((r, c),), electrode), source, t, engine="exact")
    expected = analytic.superposed(source, t, "current", *formulas.current_constants(*port))
    assert waves.output("current") == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())
    assert waves.engine == "exact"
    assert 0 < waves.errors.max() <= 1e-10


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
@pytest.mark.parametrize("which", ["paper", "rc2", "load inside"])
def test_static_strip_under_every_drive(strips: dict[str, Actuator], which: str, drive: str) -> None:
    t = np.linspace(0, 200, 500)
    source = parse_drive(drive, 200.0)
    waves = transient(strip_netlist(strips[which], beam="static"), source, t, engine="exact")
    for name in ("current", "charge", "displacement"):
        expected = getattr(analytic, name)(strips[which], source, t)
        assert waves.output(name) == pytest.approx(expected, abs=2e-11 * np.abs(expected).max()), name


@settings(max_examples=25)
@given(
    strip=random_strips(),
    gaps=st.lists(st.sampled_from([0.0, 0.3, 1.0, 5.0, 20.0]), min_size=1, max_size=8),
    data=st.data(),
)
def test_random_strips_under_random_lines(strip: Actuator, gaps: list[float], data: st.DataObject) -> None:
    values = data.draw(st.lists(st.floats(-4, 4), min_size=len(gaps), max_size=len(gaps)))
    drive = PiecewiseLinear(np.cumsum(gaps), np.array(values))
    t = np.linspace(0, 37, 112)
    system = state_space([strip_netlist(strip, beam="static")])
    waves = transient(strip_netlist(strip, beam="static"), drive, t, engine="exact")
    a, b = system.a[0], system.b[0, :, 0]
    # every smooth piece apart, so that the integrator meets no jump
    ends = np.unique(np.concatenate([[0.0], drive.breakpoints(37.0), [37.0]]))
    x = np.zeros(len(a))
    for start, end in pairwise(ends):
        inside = t[(t >= start) & (t < end)]
        u0 = float(drive.value(start))
        slope = (2 * float(drive.value((start + end) / 2)) - 2 * u0) / (end - start)

        def rate(time: float, state, u0=u0, slope=slope, start=start):
            return a @ state + b * (u0 + slope * (time - start))

        atol = 1e-12 * max(drive.largest(), 1e-9)
        solved = solve_ivp(rate, (start, end), x, "LSODA", [*inside, end], rtol=1e-9, atol=atol)
        x = solved.y[:, -1]
        u = drive.value(inside)
        outputs = system.c[0] @ solved.y[:, :-1] + system.d[0, :, :1] * u
        at = np.searchsorted(t, inside)
        for k in range(len(outputs)):
            scale = np.abs(waves.values[0, k]).max()
            assert waves.values[0, k, at] == pytest.approx(outputs[k], abs=1e-6 * scale + 1e-15)


def test_the_answer_at_a_time_does_not_depend_on_the_others() -> None:
    net, drive = strip_netlist(PAPER), parse_drive("square:4V,30s", 100.0)
    few = transient(net, drive, [1.0, 29.9, 30.0, 97.0], engine="exact").values
    many = transient(net, drive, np.unique([*np.linspace(0, 100, 333), 1.0, 29.9, 30.0, 97.0]), engine="exact")
    at = np.searchsorted(many.times, [1.0, 29.9, 30.0, 97.0])
    scale = np.abs(many.values).max(axis=2, keepdims=True)
    assert (np.abs(few - many.values[:, :, at]) <= 1e-12 * scale).all()


def test_irregular_times_are_as_good() -> None:
    t = np.unique(np.random.default_rng(3).exponential(20.0, 2000))
    net = electrical_netlist(666.667, ((19.4363, 0.35),))
    waves = transient(net, parse_drive("step:4V", t[-1]), t, engine="exact")
    expected = 4 * formulas.current_step(t, *formulas.current_constants(666.667, 19.4363, 0.35))
    assert waves.output("current") == pytest.approx(expected, rel=1e-11, abs=0)


@pytest.mark.parametrize("jump", [0.0, 5.0, 10.0])
def test_samples_on_a_jump_are_right_limits(jump: float) -> None:
    constants = formulas.current_constants(600.0, 20.0, 0.3)
    net = electrical_netlist(600.0, ((20.0, 0.3),))
    t = np.array([0.0, 5.0, 10.0])
    waves = transient(net, PiecewiseLinear.step(4.0, at=jump), t, engine="exact")
    assert waves.output("current") == pytest.approx(4 * formulas.current_step(t - jump, *constants), rel=1e-12)


def test_only_the_start() -> None:
    net = electrical_netlist(600.0, ((20.0, 0.3),))
    waves = transient(net, parse_drive("step:4V", 1.0), [0.0], engine="exact")
    assert waves.output("current") == pytest.approx(np.array([4 / 600 + 4 / 20]))


def test_a_capacitor_loop_is_told() -> None:
    elements = (Element("Vdrive", ("a", "0"), 0.0), Element("C1", ("a", "0"), 1.0))
    net = Netlist("loop", elements, (Output("v", "V", (("v(a)", 1.0),)),))
    with pytest.raises(SolveError, match="cannot solve 'loop': a loop of capacitors"):
        transient(net, parse_drive("step:1V", 1.0), [0.0, 1.0], engine="exact")


def test_constant_sources_drive_too() -> None:
    elements = (
        Element("Vdrive", ("in", "0"), 0.0),
        Element("R1", ("in", "a"), 2.0),
        Element("C1", ("a", "0"), 0.5),
        Element("Ibias", ("0", "a"), 3.0),
    )
    net = Netlist("bias", elements, (Output("v", "V", (("v(a)", 1.0),)),))
    t = np.linspace(0, 5, 50)
    waves = transient(net, parse_drive("step:1V", 5.0), t, engine="exact")
    assert waves.output("v") == pytest.approx(7 * (1 - np.exp(-t)), abs=1e-10)


@pytest.mark.parametrize("off", [0.0, 1e-13, 1e-9, 1e-4])
def test_a_sine_at_or_beside_an_undamped_resonance(off: float) -> None:
    """Of 0.5 H and 0.5 F, t in half seconds: (sin t - t cos t)/2 at resonance, beside it the difference quotient.

    The quotient is of sin(w t) - w sin(t) by 1 - w^2, to be had without cancelling: its Taylor polynomial in w - 1.
    """
    elements = (
        Element("Vdrive", ("in", "0"), 0.0),
        Element("L1", ("in", "a"), 0.5),
        Element("C1", ("a", "0"), 0.5),
    )
    net = Netlist("resonance", elements, (Output("v", "V", (("v(a)", 1.0),)),))
    t = np.linspace(0, 20, 101)
    waves = transient(net, parse_drive(f"sine:1V,{(1 + off) / np.pi!r}Hz", 10.0), t / 2, engine="exact")
    slopes = (t * np.cos(t) - np.sin(t), -(t**2) * np.sin(t), -(t**3) * np.cos(t))  # of the numerator by w, at 1
    expected = -(slopes[0] + slopes[1] * off / 2 + slopes[2] * off**2 / 6) / (2 + off)
    assert waves.output("v") == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("times", [[], [[0.0, 1.0]], [-1.0, 1.0], [0.0, np.nan], [0.0, np.inf], [1.0, 1.0], [1.0, 0.5]])
@pytest.mark.parametrize("engine", ["exact", "ngspice"])
def test_bad_times(engine: str, times: list[float]) -> None:
    with pytest.raises(InputError):
        transient(strip_netlist(PAPER), parse_drive("step:1V", 1.0), times, engine=engine)


def test_periods_cut_alike_share_their_exponentials() -> None:
    """Widths in each piece of a square wave are those of the first, although its absolute times are rounded."""
    drive = parse_drive("square:-4V..4V,14s", 700.0)
    edges = interval_grid(drive, np.array([700.0]))
    cut = np.concatenate([[0.0], np.geomspace(1e-6, 6.0, 40)])
    grid = np.union1d((edges[:-1, None] + cut).ravel(), edges)
    widths = _shared_widths(grid, edges).reshape(100, 41)
    assert (widths == widths[0]).all()
    assert len(np.unique(np.diff(grid))) > 4 * 41  # what rounding makes of them
    assert edges[:-1] + np.cumsum(widths, axis=1)[:, -1] == pytest.approx(edges[1:], abs=4 * np.spacing(700.0))


@pytest.mark.parametrize("gap", [1e-9, 1e-3])
def test_pieces_cut_otherwise_keep_their_widths(gap: float) -> None:
    grid = np.array([0.0, 1.0, 2.0, 3.0 + gap, 4.0])
    assert (_shared_widths(grid, np.array([0.0, 2.0, 4.0])) == np.diff(grid)).all()
