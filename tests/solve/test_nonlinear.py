"""Nonlinear ports by ngspice against their differential equations, written and integrated here on their own."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from every_model import port_of, strip_of
from numpy.typing import NDArray

from ilg_circuit.circuit import port_netlist, strip_netlist
from ilg_circuit.drive import Drive, PiecewiseLinear
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.report.check import summary
from ilg_circuit.simulation.check import check, require_agreement
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.solve import stepped, transient
from ilg_circuit.solve.grid import Grid
from ilg_circuit.solve.ode import port_response
from ilg_circuit.strip.port import Port

Array = NDArray[np.float64]

#: Of the largest value of a waveform.
AGREEMENT = 1e-5
DURATION = 60.0
#: A ladder that a stiff integrator can follow; the circuit is the same whatever its size.
LADDER = {"band": (1e-3, 20.0), "sections": 12}


def logged() -> PiecewiseLinear:
    """A noisy voltage of both signs, as a logger writes it."""
    t = np.linspace(0, DURATION, 31)
    return PiecewiseLinear(t, 2 * np.sin(t / 7) + 0.2 * np.random.default_rng(3).standard_normal(31), "logged")


DRIVES: dict[str, Drive] = {
    "step": parse_drive("step:3V", DURATION),
    "negative step": parse_drive("step:-3V", DURATION),
    "both signs": parse_drive("square:-2V..3V,34s", DURATION),
    "sine": parse_drive("sine:2V,0.05Hz", DURATION),
    "ramp": parse_drive("ramp:50mV/s", DURATION),
    "logged": logged(),
}


class Equations:
    """States: the voltages of the capacitors (of a ladder: sections first), C(v) v' = i; one Newton solve behind Re."""

    def __init__(self, port: Port) -> None:
        self.port = port
        if port.ladder is None:
            self.r = np.array([r for r, _ in port.branches])
            self.c = np.array([c for _, c in port.branches])
        else:
            self.r = np.array([r for r, _ in port.ladder.sections])
            self.c = np.array([c for _, c in port.ladder.sections] + [port.ladder.capacitance])
            self.series = port.series_resistance + port.ladder.resistance
        self.slope = 1 / self.series if port.ladder else float((1 / self.r).sum())

    def ion_current(self, inner: float, v: Array) -> float:
        if self.port.ladder is None:
            return float(((inner - v) / self.r).sum())
        return float((inner - v.sum()) / self.series)

    def electron_current(self, inner: float) -> tuple[float, float]:
        """And its slope."""
        vt, rdc = self.port.emission_voltage, self.port.dc_resistance
        if vt is None:
            return inner / rdc, 1 / rdc
        return vt / rdc * math.sinh(inner / vt), math.cosh(inner / vt) / rdc

    def inner(self, u: float, v: Array) -> float:
        re = self.port.electrode_resistance
        if not re:
            return u
        still, x = self.ion_current(0.0, v), u / 2
        for _ in range(100):
            i, di = self.electron_current(x)
            step = (x - u + re * (i + still + self.slope * x)) / (1 + re * (di + self.slope))
            x -= step
            if abs(step) < 1e-13:  # quadratic: what is left is rounding
                break
        return x

    def rate(self, u: float, v: Array) -> Array:
        inner = self.inner(u, v)
        i = self.ion_current(inner, v)
        if self.port.ladder is None:
            return (inner - v) / self.r / (self.c * (1 + self.port.capacitance_slope * np.abs(v)))
        through = np.append(i - v[:-1] / self.r, i)
        return through / self.c

    def outputs(self, u: float, v: Array) -> tuple[float, float]:
        inner = self.inner(u, v)
        current = self.electron_current(inner)[0] + self.ion_current(inner, v)
        if self.port.ladder is not None:
            return current, float(self.c[-1] * v[-1])
        return current, float((self.c * (v + self.port.capacitance_slope * v * np.abs(v) / 2)).sum())


def integrated(port: Port, drive: Drive, t: Array) -> Array:
    """Current and charge (2, t), integrated from edge to edge; a sample on an edge is the right limit."""
    from scipy.integrate import solve_ivp

    equations = Equations(port)
    v = np.zeros(len(equations.c))
    found = np.zeros((2, len(t)))
    for left, right in pairwise([0.0, *drive.breakpoints(t[-1]), float(t[-1])]):
        a, b = (float(drive.value(left + part * (right - left))) for part in (1e-9, 1 - 1e-9))
        straight = not drive.angular_frequency()

        def u(x: float, left: float = left, right: float = right, a: float = a, b: float = b) -> float:
            return a + (b - a) * (x - left) / (right - left) if straight else float(drive.value(x))  # noqa: B023

        inside = (t >= left) & ((t < right) | (right == t[-1]))
        run = solve_ivp(
            lambda x, y, u=u: equations.rate(u(x), y),
            (left, right),
            v,
            method="Radau",
            rtol=1e-10,
            atol=1e-13,
            t_eval=np.union1d(t[inside], [right]),
        )
        assert run.success
        at = np.searchsorted(run.t, t[inside])
        found[:, inside] = np.array(
            [equations.outputs(float(drive.value(x)), y) for x, y in zip(t[inside], run.y.T[at], strict=True)]
        ).T
        v = run.y[:, -1]
    return found


def largest_errors(found: Array, expected: Array) -> Array:
    return np.asarray(np.abs(found - expected).max(axis=-1) / np.abs(expected).max(axis=-1))


T = np.linspace(0, DURATION, 61)


# -- ngspice -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
@pytest.mark.parametrize("electrodes", [0.0, 5.0])
@pytest.mark.parametrize("model", ["rc+sinh", "rc+growing", "rc2+growing+sinh"])
def test_current_and_charge(model: str, electrodes: float, drive: Drive) -> None:
    port = port_of(model, electrodes)
    waves = transient(port_netlist(port), drive, T, accuracy=1e-6, acceptable=5e-6)
    true = largest_errors(waves.values[0], integrated(port, drive, T))
    assert true.max() <= AGREEMENT
    # the reference itself is good to some 2e-9
    assert (true <= waves.errors[0] + 5e-9).all(), "the stated error is no bound"


@pytest.mark.parametrize("drive", ["both signs", "sine"])
@pytest.mark.parametrize("model", ["rc3+sinh", "rc3+growing", "warburg+sinh", "cpe+sinh"])
def test_more_ion_paths(model: str, drive: str) -> None:
    port = port_of(model, 5.0, **(LADDER if model.startswith(("warburg", "cpe")) else {}))
    waves = transient(port_netlist(port), DRIVES[drive], T, accuracy=1e-6, acceptable=5e-6)
    true = largest_errors(waves.values[0], integrated(port, DRIVES[drive], T))
    assert true.max() <= AGREEMENT
    assert (true <= waves.errors[0] + 5e-9).all(), "the stated error is no bound"


@pytest.mark.parametrize("model", ["rc+sinh", "rc+growing"])
def test_a_law_is_odd(model: str) -> None:
    net = port_netlist(port_of(model, 5.0))
    up, down = (transient(net, DRIVES[d], T, accuracy=1e-6).values for d in ("step", "negative step"))
    assert down == pytest.approx(-up, abs=1e-6 * float(np.abs(up).max()))


def test_a_strip_moves_as_if_its_port_were_linear() -> None:
    """d(s) answers to the voltage behind Re; without Re the drive sets that."""
    expected = simulate(strip_of("rc"), DRIVES["both signs"], T).displacement
    found = simulate(strip_of("rc2+growing+sinh"), DRIVES["both signs"], T)
    assert found.displacement == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    assert found.error <= 5e-6


def test_electrodes_take_more_as_the_electron_path_opens() -> None:
    """At rest the displacement is that of the inner voltage, found by bisection."""
    t = np.array([0.0, 2000.0, 3000.0])
    found = simulate(strip_of("rc+sinh", 5.0), parse_drive("step:3V", 3000.0), t).displacement[-1]
    linear = simulate(strip_of("rc"), parse_drive("step:3V", 3000.0), t).displacement[-1]
    low, high = 0.0, 3.0
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (low, middle) if middle + 5 * 0.8 / 600 * np.sinh(middle / 0.8) > 3 else (middle, high)
    assert found / linear == pytest.approx(low / 3, rel=1e-5)


@pytest.mark.parametrize("volts", [1e-6, 1e-3])
def test_small_signals_meet_the_linear_circuit(volts: float) -> None:
    drive = PiecewiseLinear.step(volts)
    net = port_netlist(port_of("rc2+growing+sinh", 5.0))
    found = transient(net, drive, T, accuracy=1e-6, acceptable=5e-6)
    exact = transient(net.linearised(), drive, T, engine="exact")
    # what is left of the laws goes with the voltage
    assert largest_errors(found.values[0], exact.values[0]).max() <= 1e-5 + volts


def test_the_exact_engine_says_that_it_cannot() -> None:
    with pytest.raises(InputError, match="the exact engine solves linear circuits only"):
        transient(port_netlist(port_of("rc+sinh")), DRIVES["step"], T, engine="exact")


def test_an_error_that_is_not_acceptable_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    """With two grids an error is left: a failure, or a result with its error where that was asked."""
    monkeypatch.setattr(stepped, "_MOST_REFINEMENTS_NONLINEAR", 2)
    net, drive, t = port_netlist(port_of("rc+growing")), parse_drive("sine:2V,0.2Hz", 20.0), np.linspace(0, 20, 11)
    with pytest.raises(SolveError, match=r"ngspice reached an error of .* not the 1.0e-10 asked for"):
        transient(net, drive, t, accuracy=1e-10)
    found = transient(net, drive, t, accuracy=1e-10, acceptable=1e-4)
    assert 1e-10 < found.errors.max() <= 1e-4


@pytest.mark.parametrize(("model", "grids"), [("rc+saturating", 1), ("rc+steric", 1), ("rc+growing", 2)])
def test_a_law_without_a_kink_needs_no_second_grid(monkeypatch: pytest.MonkeyPatch, model: str, grids: int) -> None:
    """The runs on one grid tell the error of what is smooth; at a kink half the steps must give the same."""
    port, drive, t = port_of(model), PiecewiseLinear.square(-2.0, 2.0, 12.0, 20.0), np.linspace(0.0, 20.0, 401)
    solved: list[int] = []
    extrapolated = stepped.Batch._extrapolated

    def counted(batch: stepped.Batch, grid: Grid, settled: float | None, *, stiff: bool) -> tuple[Array, Array, Array]:
        solved.append(len(grid.nodes))
        return extrapolated(batch, grid, settled, stiff=stiff)

    monkeypatch.setattr(stepped.Batch, "_extrapolated", counted)
    found = transient([port_netlist(port)], drive, t, accuracy=1e-6).output("current")
    assert len(solved) == grids
    assert np.abs(found - port_response(port, drive, t)[0]).max() <= 1e-6 * np.abs(found).max()


def test_several_nonlinear_ports_at_once_are_each_alone() -> None:
    ports = [replace(port_of("rc+sinh", 5.0), emission_voltage=v) for v in (0.5, 0.8, 1.5)]
    together = transient([port_netlist(p) for p in ports], DRIVES["sine"], T, accuracy=1e-6)
    for k, port in enumerate(ports):
        alone = transient(port_netlist(port), DRIVES["sine"], T, accuracy=1e-6).values[0]
        assert largest_errors(together.values[k], alone).max() <= 2e-6


def test_kinks_of_nearly_equal_ports_leave_a_grid_that_ngspice_can_follow() -> None:
    """Those of a central difference and others, in numbers of numpy's: their charges pass zero all but together."""
    drive = PiecewiseLinear(np.repeat([0.0, 20.0, 40.0], 2)[1:], np.repeat([2.0, -1.0, 1.5], 2)[:-1])
    base = port_of("rc+growing", 0.0)
    (r, c), *_ = base.branches
    ports = [replace(base, branches=((r, c * f),)) for f in (1.0001, 0.9999, 1.0, *(1 + 1e-15 * np.arange(9)))]
    found = transient([port_netlist(p) for p in ports], drive, T, accuracy=1e-7, acceptable=1e-6).values
    assert max(largest_errors(other, found[2]).max() for other in found[3:]) <= 1e-12
    assert largest_errors((found[0] + found[1]) / 2, found[2]).max() <= 1e-7


# -- the package's own check -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", ["rc+sinh", "rc2+growing"])
def test_check_compares_with_the_equations(model: str) -> None:
    response = simulate(strip_of(model, 5.0), DRIVES["both signs"], T[:21])
    differences = check(response, tip="free", beam="dynamic")
    assert {(d.quantity, d.reference) for d in differences} == {
        ("current", "port's equations"),
        ("charge", "port's equations"),
    }
    require_agreement(differences)
    wrong = check(response.with_waveforms(charge=1.001 * response.charge), tip="free", beam="dynamic")
    with pytest.raises(SolveError, match=r"check failed: charge differs from the port's equations by 1.0e-03"):
        require_agreement(wrong)
    assert "port's equations" in summary(differences)


def test_the_package_integrates_the_same_equations() -> None:
    from ilg_circuit.solve.ode import port_response

    t = T[:21]
    for model, drive in (("rc2+growing+sinh", "both signs"), ("warburg+sinh", "ramp")):
        port = port_of(model, 5.0, **(LADDER if "warburg" in model else {}))
        found = np.array(port_response(port, DRIVES[drive], t))
        assert found == pytest.approx(integrated(port, DRIVES[drive], t), abs=1e-8)
        assert np.array(port_response(port, DRIVES[drive], t[:1])) == pytest.approx(
            found[:, :1], rel=1e-12
        )  # the start


def test_topologies_tell_laws_apart() -> None:
    """Copies of one netlist may differ in values alone."""
    with pytest.raises(InputError, match="one topology"):
        transient(
            [strip_netlist(strip_of("rc+sinh")), strip_netlist(strip_of("rc"))], DRIVES["step"], np.array([0.0, 1.0])
        )


def test_a_jump_beside_a_steep_slope_has_its_place() -> None:
    """All but linear, so that the exact engine knows the answer; one step over the jump would lean with the slope."""
    times, volts = np.array([0.0, 0.5, 0.5006, 0.5006, 2.0]), np.array([-0.3, -0.3, -0.46, -0.3, 0.4])
    drive, t = PiecewiseLinear(times, volts, "file"), np.linspace(0.0, 2.0, 201)
    strip = strip_of("rc")
    growing = replace(strip, material=replace(strip.material, capacitance_slope=1e-9))
    exact, found = simulate(strip, drive, t, engine="exact").waveforms, simulate(growing, drive, t)
    for name in ("current", "charge"):
        largest = np.abs(exact[name]).max()
        assert np.abs(found.waveforms[name] - exact[name]).max() <= found.error * largest, name


def test_voltages_that_do_not_settle_to_their_last_digits_are_solved_all_the_same() -> None:
    """The fast sections of a ladder make steps of 1e-10 s, in whose currents rounding is amplified."""
    strip = strip_of("warburg+sinh")
    corners = PiecewiseLinear(np.array([0.0, 15.0, 45.0, 60.0]), np.array([0.0, 3.0, -3.0, 0.0]), "triangle")
    t = np.linspace(0.0, 60.0, 121)
    whole = simulate(strip, corners, t, beam="static")
    # without the fastest sections, which the current does not show
    slower = simulate(strip_of("warburg+sinh", **LADDER), corners, t, beam="static")
    assert np.abs(whole.current - slower.current)[2:].max() < 1e-3 * np.abs(slower.current).max()
