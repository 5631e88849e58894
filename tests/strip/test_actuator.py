"""The description of a strip: what it accepts, what it derives."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import log_floats, strips

from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import (
    CANTILEVER_EIGENVALUE,
    PAPER,
    PRESETS,
    Actuator,
    Coupling,
    Geometry,
    IonBranch,
    Material,
    Mounting,
)
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.port import Port

RECORDS: dict[type, dict[str, float]] = {
    Geometry: {"length": 35e-3, "free_length": 30e-3, "width": 5e-3, "thickness": 0.5e-3},
    Material: {"dc_resistivity": 233.0, "dynamic_resistivity": 6.8, "permittivity": 1.0, "youngs_modulus": 7600.0},
    Coupling: {"gain": 2.4e-9, "zero": 0.2, "damping_ratio": 0.6, "natural_frequency": 0.07},
    IonBranch: {"dynamic_resistivity": 60.0, "permittivity": 0.4},
}
MAY_BE_ZERO = (
    "beam_damping_ratio",
    "electrode_resistivity_1",
    "electrode_thickness_1",
    "electrode_resistivity_2",
    "electrode_thickness_2",
)
MUST_BE_POSITIVE = [(kind, key) for kind, values in RECORDS.items() for key in values] + [(Material, "density")]


@pytest.mark.parametrize(("kind", "key"), MUST_BE_POSITIVE, ids=lambda x: getattr(x, "__name__", x))
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, -math.inf])
def test_values_out_of_range_are_refused_by_name(kind: type, key: str, value: float) -> None:
    with pytest.raises(InputError, match=rf"{kind.__name__.lower()}\.{key} is"):
        kind(**RECORDS[kind] | {key: value})


@pytest.mark.parametrize("key", MAY_BE_ZERO)
def test_some_values_may_be_zero_but_not_negative(key: str) -> None:
    assert getattr(Material(**RECORDS[Material] | {key: 0}), key) == 0.0
    with pytest.raises(InputError, match=rf"material\.{key} is -1; it must be zero or more"):
        Material(**RECORDS[Material] | {key: -1.0})


@pytest.mark.parametrize(
    "value",
    ["30 mm", None, True, 1j, [0.03], np.array([0.03, 0.1]), 10**400],
    ids=["text", "none", "bool", "complex", "list", "array", "huge int"],
)
def test_what_is_no_number_is_refused(value: Any) -> None:
    with pytest.raises(InputError, match=r"geometry\.length"):
        Geometry(**RECORDS[Geometry] | {"length": value})


@pytest.mark.parametrize("value", [1, np.float64(1.0), np.float32(1.0), np.int64(1)])
def test_numbers_of_every_kind_become_floats(value: Any) -> None:
    g = Geometry(**RECORDS[Geometry] | {"length": value})
    assert type(g.length) is float
    assert g.length == 1.0


def test_the_free_part_cannot_exceed_the_whole() -> None:
    with pytest.raises(InputError, match=r"longer than geometry\.length"):
        Geometry(length=29e-3, free_length=30e-3, width=5e-3, thickness=0.5e-3)
    assert Geometry(length=30e-3, free_length=30e-3, width=5e-3, thickness=0.5e-3).free_length == 30e-3


def test_the_load_sits_on_the_free_part() -> None:
    with pytest.raises(InputError, match=r"beyond geometry\.free_length"):
        replace(PAPER.geometry, load_position=31e-3)
    with pytest.raises(InputError, match="load_position is 0"):
        replace(PAPER.geometry, load_position=0)
    assert PAPER.geometry.load_distance == 30e-3
    assert replace(PAPER.geometry, load_position=20e-3).load_distance == 20e-3


def test_orientations() -> None:
    assert PAPER.mounting.orientation == "weightless"
    with pytest.raises(InputError, match="weightless, hanging, horizontal"):
        Mounting("upside down")


def test_records_are_values() -> None:
    with pytest.raises(FrozenInstanceError):
        PAPER.name = "other"
    assert replace(PAPER) == PAPER
    assert hash(replace(PAPER)) == hash(PAPER)
    assert PRESETS["paper"] is PAPER


def test_branches_count_the_first_one() -> None:
    more = replace(PAPER.material, further_branches=[IonBranch(60.0, 0.4)])
    assert more.further_branches == (IonBranch(60.0, 0.4),)
    assert more.branches == (IonBranch(4 / 0.2058 * 0.35, 1.0), IonBranch(60.0, 0.4))
    assert len(PAPER.material.branches) == 1


def test_static_coupling() -> None:
    k = Coupling(gain=2e-9, zero=0.5, damping_ratio=1.0, natural_frequency=0.1)
    assert k.static == pytest.approx(1e-7)


def test_cantilever_eigenvalue() -> None:
    x = CANTILEVER_EIGENVALUE
    assert math.cos(x) * math.cosh(x) == pytest.approx(-1, abs=1e-14)


@given(
    strip=strips(),
    dc=log_floats(1e-3, 1e6),
    pairs=st.lists(st.tuples(log_floats(1e-3, 1e5), log_floats(1e-6, 1e4)), min_size=1, max_size=4),
    electrode=st.one_of(st.just(0.0), log_floats(1e-3, 1e3)),
)
def test_the_strip_of_given_circuit_values_has_them(
    strip: Actuator, dc: float, pairs: list[tuple[float, float]], electrode: float
) -> None:
    port = Port(dc, tuple(pairs), electrode)
    made = Actuator.from_port(strip.geometry, port, base=strip.material, coupling=strip.coupling, name="made")
    lumped = lumped_elements(made)
    close = {"rel": 1e-14, "abs": 0}
    assert lumped.port.dc_resistance == pytest.approx(dc, **close)
    assert lumped.port.electrode_resistance == pytest.approx(electrode, **close)
    for (r, c), (wanted_r, wanted_c) in zip(lumped.port.branches, pairs, strict=True):
        assert r == pytest.approx(wanted_r, **close)
        assert c == pytest.approx(wanted_c, **close)
    assert made.material.youngs_modulus == strip.material.youngs_modulus
    assert made.material.density == strip.material.density
    assert made.material.beam_damping_ratio == strip.material.beam_damping_ratio
    assert made.coupling == strip.coupling
    assert made.name == "made"


@pytest.mark.parametrize(
    "change", [{"dc_resistance": -1.0}, {"branches": ((1.0, 0.0),)}, {"electrode_resistance": -1.0}]
)
def test_impossible_circuit_values_are_refused(change: dict[str, Any]) -> None:
    values: dict[str, Any] = {"dc_resistance": 600.0, "branches": ((20.0, 0.3),), "electrode_resistance": 0.0}
    with pytest.raises(InputError):
        Actuator.from_port(PAPER.geometry, Port(**values | change), base=PAPER.material)
