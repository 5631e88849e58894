"""The shape of a strip against closed forms, published values, the linear beam and virtual work."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ellipk, ellipkinc

import ilg_circuit as ilg
from ilg_circuit.errors import InputError
from ilg_circuit.report import shape as report
from ilg_circuit.simulation.curvature import Curvatures
from ilg_circuit.simulation.elastica import Acting, acting, elastica
from ilg_circuit.simulation.shape import along, arcs, static_shape
from ilg_circuit.strip.elements import bending_stiffness

#: Four segments under +4, -4, +4, -4 V: the free strain of the paper's strip over half its thickness.
BEND = 2.2113870e-3 / 0.25e-3
FOUR = Curvatures(np.zeros(1), np.full(4, 7.5e-3), np.array([[BEND, -BEND, BEND, -BEND]]))
STRAIGHT = Curvatures(np.zeros(1), np.ones(1), np.zeros((1, 1)))


def test_four_segments_of_alternating_sign() -> None:
    x, y, angle = arcs(FOUR, FOUR.ends)
    np.testing.assert_allclose([1e3 * x[0, -1], 1e3 * y[0, -1]], [29.97800, 0.99476], atol=5e-6)
    assert abs(angle[0, -1]) < 1e-15


def test_arcs_are_exact_whatever_the_angle_and_the_places() -> None:
    bends = np.array([[300.0, -40.0], [1e-9, 0.0], [2 * np.pi / 0.01, 1e-3]])
    free = Curvatures(np.arange(3.0), np.array([0.01, 0.02]), bends)
    places = along(free, 11, np.array([0.0123]))
    x, y, angle = arcs(free, places)
    fine = np.linspace(0, 0.03, 60001)
    middle = free.angles((fine[1:] + fine[:-1]) / 2)
    for found, part in ((x, np.cos(middle)), (y, np.sin(middle))):
        path = np.pad(np.cumsum(part, axis=1) * fine[1], ((0, 0), (1, 0)))
        np.testing.assert_allclose(found, [np.interp(places, fine, row) for row in path], atol=1e-9)
    assert abs(x[2, places == 0.01]) < 1e-16  # a full circle
    np.testing.assert_allclose(angle, free.angles(places), rtol=0, atol=0)
    assert {0.01, 0.0123, 0.03} <= set(places)
    one = Curvatures(free.time, np.array([0.03]), bends[:, :1])
    two = Curvatures(free.time, np.array([0.01, 0.02]), bends[:, [0, 0]])
    np.testing.assert_allclose(arcs(one, places), arcs(two, places), atol=1e-15)


@pytest.mark.parametrize(
    ("load", "shortened", "deflected"),  # P L^2/EI, 1 - x/L and y/L: Mattiasson 1981, after Bisshopp & Drucker 1945
    [(0.2, 0.00265, 0.06636), (1.0, 0.05643, 0.30172), (2.0, 0.16064, 0.49346), (10.0, 0.55500, 0.81061)],
)
def test_cantilever_under_an_end_load(load: float, shortened: float, deflected: float) -> None:
    x, y, angle = elastica(STRAIGHT, 1.0, Acting(force=(0.0, load)), np.array([0.0, 1.0]))
    assert (1 - x[0, -1], y[0, -1]) == (pytest.approx(shortened, abs=6e-6), pytest.approx(deflected, abs=6e-6))
    # by elliptic integrals, with the tip's angle as found: sqrt(load) = K(m) - F(phi, m), m = (1 + sin angle)/2
    m = (1 + np.sin(angle[0, -1])) / 2
    phi = np.arcsin(1 / np.sqrt(2 * m))
    assert ellipk(m) - ellipkinc(phi, m) == pytest.approx(np.sqrt(load), rel=1e-9)
    assert x[0, -1] == pytest.approx(np.sqrt(2 * np.sin(angle[0, -1]) / load), rel=1e-9)


def test_a_pulled_strip_bends_in_a_boundary_layer() -> None:
    bend = Curvatures(np.zeros(1), np.ones(1), np.full((1, 1), 1e-3))
    pull = 2500.0
    angle = elastica(bend, 1.0, Acting(force=(pull, 0.0)), np.array([0.9, 1.0]))[2]
    root = np.sqrt(pull)
    np.testing.assert_allclose(angle[0], 1e-3 / root * np.sinh([0.9 * root, root]) / np.cosh(root), rtol=1e-6)


def test_equations_of_the_elastica_hold_with_everything_acting() -> None:
    on = Acting(weight=(3.0, -5.0), force=(0.5, -2.0), spring=4.0, place=0.6)
    bent = replace(FOUR, lengths=np.full(4, 0.25), values=np.array([[2.0, -3.0, 1.0, 5.0]]))
    s = np.linspace(0.0, 1.0, 4001)
    x, y, angle = (part[0] for part in elastica(bent, 1.0, on, s))
    rest = elastica(STRAIGHT, 1.0, replace(on, spring=0.0), np.array([0.6]))[1][0, 0]
    middle = (s[1:] + s[:-1]) / 2
    moment = np.diff(angle) / s[1] - bent.values[0, (4 * middle).astype(int)]
    hold = -on.spring * (np.interp(0.6, s, y) - rest) * (middle < 0.6)
    force = (3.0 * (1 - middle) + 0.5, -5.0 * (1 - middle) - 2.0 + hold)
    slope = force[0] * np.sin((angle[1:] + angle[:-1]) / 2) - force[1] * np.cos((angle[1:] + angle[:-1]) / 2)
    total = np.append(0.0, np.cumsum(slope[::-1]) * s[1])[::-1]  # minus the moment, from the free end, where it is zero
    np.testing.assert_allclose(moment, -(total[1:] + total[:-1]) / 2, atol=2e-6)
    np.testing.assert_allclose(
        [np.diff(x) / s[1], np.diff(y) / s[1]], [np.cos(angle[1:]), np.sin(angle[1:])], atol=2e-3
    )


def test_virtual_work() -> None:
    # what the change of the free curvature does against the moment is stored in the strip and lifts the weight
    t = np.linspace(0, 2 * np.pi, 81)
    bends, s = 1.5 + np.sin(t), np.linspace(0.0, 1.0, 401)
    free = Curvatures(t, np.ones(1), bends[:, None])
    _, y, angle = elastica(free, 1.0, Acting(force=(0.0, -1.0)), s)
    moment = np.gradient(angle, s, axis=1, edge_order=2) - bends[:, None]
    stored = 0.5 * np.trapezoid(moment**2, s, axis=1) + y[:, -1]
    actuator = -np.trapezoid(moment, s, axis=1)  # times the rate of the free curvature
    work = np.append(0.0, np.cumsum((actuator[1:] + actuator[:-1]) / 2 * np.diff(bends)))
    np.testing.assert_allclose(stored - stored[0], work, atol=1e-3 * np.ptp(stored))


@pytest.mark.parametrize(
    "changes", [{}, {"orientation": "hanging"}, {"orientation": "hanging", "load_position": "15mm"}]
)
@pytest.mark.parametrize("load", [None, "mass=20mg"])
def test_small_deflections_are_those_of_the_circuit(changes: dict[str, str], load: str | None) -> None:
    strip = ilg.load("paper").with_(youngs_modulus="2MPa", **changes)
    run = ilg.simulate(strip, "step:10mV", "300s", samples=3, engine="exact", load=load)
    shape = ilg.shape(run)
    tip = shape.y[-1, np.flatnonzero(np.isclose(shape.s, strip.geometry.load_distance))[0]]
    assert tip == pytest.approx(run.displacement[-1], rel=1e-6)


def test_a_held_tip_stays_and_the_strip_bulges() -> None:
    run = ilg.simulate("paper", "square:-4V..4V,60s", "60s", samples=31, engine="exact", tip="clamped")
    shape = ilg.shape(run)
    assert np.abs(shape.y[:, -1]).max() < 1e-8
    # the linear beam with a force at its tip; 0.25 mm at 2/3 of the length
    assert run.curvatures is not None
    bend = run.curvatures.values[-1, 0]
    np.testing.assert_allclose(shape.y[-1], -bend / 4 * (shape.s**2 - shape.s**3 / shape.s[-1]), atol=2e-6)


def test_a_strip_stays_at_its_equilibrium_until_that_vanishes() -> None:
    # pressed along x beyond Euler's load pi^2/4, it stands on one side until the curvature turns it over
    t = np.linspace(0, 2 * np.pi, 81)
    free = Curvatures(t, np.ones(1), 0.4 * np.sin(t)[:, None])
    _, y, _ = elastica(free, 1.0, Acting(force=(-1.2 * np.pi**2 / 4, 0.0)), np.array([1.0]))
    above = y[:, 0] > 0
    np.testing.assert_array_equal(above[[10, 43, 60, 80]], [True, True, False, False])
    # soft beside its weight: it hangs straight down from a corner, with a radius of some sqrt(EI/n)
    _, y, angle = elastica(STRAIGHT, 1.0, Acting(weight=(0.0, -1e6)), np.array([0.5, 1.0]))
    np.testing.assert_allclose(y[0], [-0.5, -1.0], atol=1e-3)
    np.testing.assert_allclose(angle[0], -np.pi / 2, atol=1e-6)


def test_paper_strip_on_its_side_hangs_down() -> None:
    strip = ilg.load("paper").with_(orientation="horizontal")
    shape = ilg.shape(ilg.simulate(strip, "step:4V", "100s", samples=5, engine="exact"))
    assert shape.tip[-1, 1] < -0.98 * 0.03
    again = acting(strip)
    force = 1250 * 5e-3 * 0.5e-3 * 9.80665
    assert again.weight == (0.0, pytest.approx(-force))
    # the moment at the clamp is that of the weight
    moment = bending_stiffness(strip) * ((shape.angle[0, 1] - shape.angle[0, 0]) / shape.s[1])
    assert moment == pytest.approx(-force * np.trapezoid(shape.x[0], shape.s), rel=0.6)


def test_levels_of_mechanics_and_what_is_left_out() -> None:
    run = ilg.simulate("paper", "step:4V", "300s", samples=11, engine="exact")
    free, bent = run.shape("free"), run.shape()
    np.testing.assert_array_equal(free.y, bent.y)
    assert free.warnings == ()
    assert free.tip[-1, 1] == pytest.approx(3.95719e-3, abs=5e-9)
    assert run.curvatures is not None
    assert free.angle[-1, -1] == pytest.approx(run.curvatures.values[-1, 0] * 0.03)
    loaded = ilg.simulate("paper", "step:4V", "300s", samples=3, engine="exact", load="stiffness=1mN/m")
    (warning,) = loaded.shape("free").warnings
    assert "elastica" in warning
    assert loaded.shape().warnings == ()
    assert loaded.shape().tip[-1, 1] == pytest.approx(loaded.displacement[-1], rel=2e-3)
    with pytest.raises(InputError, match="mechanics"):
        run.shape("frei")
    with pytest.raises(InputError, match="points"):
        ilg.shape(run, points=1)
    with pytest.raises(InputError, match="coupling"):
        static_shape(replace(run, curvatures=None))
    with pytest.raises(InputError, match="run"):
        ilg.shape(3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="shape"):
        Curvatures(np.zeros(2), np.ones(3), np.zeros((2, 2)))


def test_pictures_have_equal_scales(tmp_path: Path) -> None:
    shape = ilg.simulate("paper", "square:-4V..4V,30s", "60s", samples=61, engine="exact").shape()
    figure = shape.figure()
    strips = figure.axes[0]
    assert strips.get_aspect() == 1.0
    low, high = strips.get_ylim()
    assert low <= 1e3 * shape.y.min() < 1e3 * shape.y.max() <= high
    drawn = [line for line in strips.lines if len(line.get_xdata()) == len(shape.s)]
    assert len(drawn) >= 10
    assert len({line.get_color() for line in drawn}) == len(drawn)
    with pytest.raises(InputError, match="gif"):
        report.animate(shape, tmp_path / "strip.png")
