"""The arm's description: rest shapes, compiled form, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ilg_circuit.arms import OCTOPUS, Arm, Fluid, Muscle, Plane, strip_arm
from ilg_circuit.arms.lattice import cell_areas, model
from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import PAPER


def test_straight_rest_shape(strip: Arm) -> None:
    q = strip.rest_positions()
    assert q.shape == (16, 2, 2)
    assert q[-1] == pytest.approx(np.array([[30e-3, 0.25e-3], [30e-3, -0.25e-3]]))
    assert cell_areas(q) == pytest.approx(2e-3 * 0.5e-3)


def test_curved_rest_shape_is_an_arc_and_free_of_stress(strip: Arm) -> None:
    curved = replace(strip, curvature=20.0, segments=7)
    centre = curved.rest_positions().mean(axis=1)
    assert np.hypot(centre[:, 0], centre[:, 1] - 0.05) == pytest.approx(0.05)
    assert centre[-1] == pytest.approx([0.05 * math.sin(0.6), 0.05 * (1 - math.cos(0.6))])


def test_masses_add_up_and_taper_is_linear() -> None:
    m = model(OCTOPUS)
    exact = 1042 * 0.24 * (15e-3**2 + 15e-3 * 1e-3 + 1e-3**2) / 3
    assert 2 * m.mass.sum() == pytest.approx(exact, rel=2e-3)
    assert OCTOPUS.tapered(at_cells=False)[0][[0, -1]] == pytest.approx([15e-3, 1e-3])


def test_bending_and_axial_stiffness(strip: Arm) -> None:
    """Two edges make E I; with constant area, edges and rods make E A: k_edge 2 l^2 + k_rod h^2 = E A l."""
    m = model(strip)
    e, b, h, length = 7600.0, 5e-3, 0.5e-3, 2e-3
    edge, rods = m.spring_stiffness[6], m.spring_stiffness[30:]
    assert 2 * edge * (h / 2) ** 2 == pytest.approx(e * b * h**3 / 12 / length)
    assert 2 * edge * length**2 + rods[3] * h**2 == pytest.approx(e * b * h * length)
    assert rods[-1] == pytest.approx(rods[3] / 2)


@pytest.mark.parametrize("formulation", ["beam", "yekutieli"])
def test_the_end_rods_are_half_of_the_others(formulation: str) -> None:
    """Every cell has two halves of rods; each end rod belongs to one cell only."""
    arm = replace(strip_arm(segments=5), formulation=formulation)
    m = model(arm)
    inner, *rods = m.spring_stiffness[11], *m.spring_stiffness[10:]
    whole = 2 / 3 * 7600 if formulation == "beam" else Muscle().passive
    assert inner == pytest.approx(whole * 5e-3 * 6e-3 / 0.5e-3)
    assert np.array(rods) / inner == pytest.approx([0.5, 1, 1, 1, 1, 0.5])
    assert (m.spring_active[10:] > 0).all() == (formulation == "yekutieli")


def test_drag_is_of_the_surface_that_it_acts_on() -> None:
    """Along: of both faces and both sides, 2 (h + b) l; across: of what stands in the way, b l."""
    fluid = Fluid(density=1000.0, drag_across=1.5, drag_along=0.02)
    arm = Arm(
        length=60e-3, thickness=4e-3, depth=10e-3, density=1042.0, tip_thickness=2e-3, tip_depth=6e-3, segments=2,
        fluid=fluid,
    )  # fmt: skip
    h, b, piece = np.array([3.5e-3, 2.5e-3]), np.array([9e-3, 7e-3]), 30e-3
    drag = model(arm).drag
    assert drag[:, 0] == pytest.approx(500.0 * 0.02 * 2 * (h + b) * piece)
    assert drag[:, 1] == pytest.approx(500.0 * 1.5 * b * piece)
    assert len(model(replace(arm, fluid=None)).drag) == 0


def test_a_strip_as_an_arm() -> None:
    arm = strip_arm(PAPER, segments=30, mounting="hanging")
    assert (arm.length, arm.thickness, arm.depth, arm.segments) == (30e-3, 0.5e-3, 5e-3, 30)
    assert arm.direction == -math.pi / 2
    assert arm.gravity[1] < 0
    # the loss time damps the first mode by the strip's ratio: zeta = damping w/2
    assert arm.damping * arm.first_frequency / 2 == pytest.approx(PAPER.material.beam_damping_ratio)
    assert strip_arm().gravity == (0.0, 0.0)


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        ({"segments": 0}, "arm.segments is 0; give 1 to 5000"),
        ({"segments": 2.5}, "give a whole number"),
        ({"segments": True}, "give a whole number"),
        ({"length": math.nan}, "arm.length is nan"),
        ({"thickness": -1e-3}, "arm.thickness is -0.001; it must be more than zero"),
        ({"density": 0.0}, "arm.density is 0"),
        ({"damping": math.inf}, "arm.damping is inf"),
        ({"tip_depth": -1.0}, "arm.tip_depth is -1"),
        ({"formulation": "rope"}, "choose one of beam, chain, yekutieli"),
        ({"gravity": (0.0, math.nan)}, "arm.gravity"),
        ({"gravity": 9.8}, "give two finite numbers"),
        ({"direction": math.nan}, "arm.direction is nan"),
        ({"curvature": (1.0, 2.0)}, "2 values for 15 segments"),
        ({"curvature": math.nan}, "curvature of segment 1 is nan"),
        ({"curvature": 3000.0}, "fold over"),
    ],
)
def test_an_arm_out_of_range_is_refused(strip: Arm, change: dict[str, Any], hint: str) -> None:
    with pytest.raises(InputError) as caught:
        replace(strip, **change)
    assert hint in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("part", "values", "hint"),
    [
        (Muscle, {"rest_ratio": 1.0}, "muscle.rest_ratio is 1; it must be below 1"),
        (Muscle, {"rest_ratio": 0.0}, "more than zero"),
        (Muscle, {"rest_ratio": math.nan}, "muscle.rest_ratio is nan"),
        (Muscle, {"passive": -1.0}, "muscle.passive"),
        (Fluid, {"density": -1.0}, "fluid.density"),
        (Plane, {"point": (0, 0), "normal": (0, 0), "stiffness": 1.0}, "plane.normal is zero"),
        (Plane, {"point": (0, math.inf), "normal": (0, 1), "stiffness": 1.0}, "plane.point"),
        (Plane, {"point": (0, 0), "normal": (0, 1), "stiffness": 0.0}, "plane.stiffness"),
    ],
)
def test_parts_out_of_range_are_refused(part: Any, values: dict[str, Any], hint: str) -> None:
    with pytest.raises(InputError) as caught:
        part(**values)
    assert hint in str(caught.value)


def test_an_unknown_mounting_is_refused() -> None:
    with pytest.raises(InputError, match="choose one of weightless, hanging, horizontal"):
        strip_arm(mounting="sideways")
