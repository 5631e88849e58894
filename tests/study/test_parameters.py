"""What can be varied, and what becomes of the rest of a strip when it is."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.circuit.load import Load
from ilg_circuit.drive import PiecewiseLinear, Sine
from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import PAPER, Coupling, Geometry, Material, Uncertainty
from ilg_circuit.study.parameters import PARAMETERS, ScenarioTemplate, apply, varied_parameter

BASE = ScenarioTemplate(PAPER, "step:4V", 300.0)


def test_every_quantity_of_an_actuator_can_be_varied() -> None:
    names = {f.name for kind in (Geometry, Material, Coupling) for f in fields(kind) if "unit" in f.metadata}
    assert names <= set(PARAMETERS)


@given(st.sampled_from(sorted(f.name for f in fields(Coupling) if "unit" in f.metadata)), st.floats(1e-9, 1e3))
def test_a_value_arrives_where_it_belongs(name: str, value: float) -> None:
    scenario = apply(BASE, {name: value})
    assert getattr(scenario.actuator.coupling, name) == value
    assert replace(scenario.actuator, coupling=PAPER.coupling) == PAPER


def test_the_clamped_part_keeps_its_length() -> None:
    geometry = apply(BASE, {"free_length": 60e-3}).actuator.geometry
    assert geometry.length == pytest.approx(65e-3)
    assert geometry.load_position is None
    loaded = replace(BASE, actuator=replace(PAPER, geometry=replace(PAPER.geometry, load_position=15e-3)))
    assert apply(loaded, {"free_length": 60e-3}).actuator.geometry.load_position == pytest.approx(30e-3)
    assert apply(loaded, {"free_length": 20e-3, "length": 50e-3, "load_position": 1e-3}).actuator.geometry == Geometry(
        length=50e-3, free_length=20e-3, width=5e-3, thickness=0.5e-3, load_position=1e-3
    )


def test_a_strip_that_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match="longer than geometry"):
        apply(BASE, {"free_length": 60e-3, "length": 50e-3})
    with pytest.raises(InputError, match="thickness is nan"):
        apply(BASE, {"thickness": np.nan})
    with pytest.raises(InputError, match=r"thickness is -0\.001"):
        apply(BASE, {"thickness": -1e-3})


def test_unknown_names_are_answered_with_near_ones() -> None:
    with pytest.raises(InputError, match="perhaps thickness"):
        varied_parameter("thikness")
    with pytest.raises(InputError, match="known are length, free_length"):
        varied_parameter("@")


@pytest.mark.parametrize(
    ("drive", "changed", "expected"),
    [
        ("step:4V", {"voltage": 2.0}, [2.0, 2.0, 2.0]),
        ("step:4V", {"voltage": -2.0}, [-2.0, -2.0, -2.0]),
        ("square:-4V..2V,30s", {"voltage": 2.0}, [1.0, -2.0, 1.0]),
        ("square:4V,30s", {"period": 60.0}, [4.0, 4.0, 0.0]),
        ("square:4V,30s", {"duty": 0.9}, [4.0, 4.0, 4.0]),
        ("ramp:1V/s", {"rate": 2.0}, [2.0, 50.0, 80.0]),
    ],
)
def test_drives(drive: str, changed: dict[str, float], expected: list[float]) -> None:
    scenario = apply(replace(BASE, drive=drive), changed)
    assert scenario.drive.value([1.0, 25.0, 40.0]).tolist() == pytest.approx(expected)


def test_a_drive_of_one_s_own_can_be_scaled() -> None:
    own = PiecewiseLinear(np.array([0.0, 10.0]), np.array([0.0, -2.0]), "own")
    scenario = apply(replace(BASE, drive=own), {"voltage": 3.0})
    assert scenario.drive.value([5.0, 10.0]).tolist() == [-1.5, -3.0]
    assert apply(replace(BASE, drive=own), {"thickness": 1e-3}).drive is own
    with pytest.raises(InputError, match="not part of the drive 'file:own'"):
        apply(replace(BASE, drive=own), {"period": 3.0})


def test_sine() -> None:
    scenario = apply(replace(BASE, drive="sine:2V,0.1Hz"), {"voltage": 3.0, "frequency": 0.25})
    assert scenario.drive == Sine(3.0, 0.25)


@pytest.mark.parametrize(
    ("drive", "name", "hint"),
    [
        ("step:4V", "period", "belongs to square"),
        (
            "ramp:1V/s",
            "voltage",
            "step and square and triangle and cv and pulse and sine and chirp",
        ),
        ("square:0V,30s", "voltage", "is zero"),
    ],
)
def test_a_drive_without_that_number(drive: str, name: str, hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        apply(replace(BASE, drive=drive), {name: 1.0})


def test_loads_branches_and_mounting(strips: dict[str, object]) -> None:
    assert apply(replace(BASE, load=Load(mass=1e-6)), {"load_stiffness": 1e-6}).load == Load(1e-6, 1e-6)
    assert apply(BASE, {"orientation": "horizontal"}).actuator.mounting.orientation == "horizontal"
    two = apply(replace(BASE, actuator=strips["rc2"]), {"permittivity_2": 0.7})  # type: ignore[arg-type]
    assert two.actuator.material.further_branches[0].permittivity == 0.7
    with pytest.raises(InputError, match="belongs to ionic branch 2"):
        apply(BASE, {"permittivity_2": 0.7})
    with pytest.raises(InputError, match="no \\[coupling\\]"):
        apply(replace(BASE, actuator=replace(PAPER, coupling=None)), {"gain": 1.0})


def test_the_uncertainty_is_that_of_the_constants_not_of_the_size() -> None:
    known = replace(PAPER, uncertainty=Uncertainty("rc", ("dc_resistance",), ((0.01,),)))
    template = replace(BASE, actuator=known)
    assert apply(template, {"thickness": 1e-3}).actuator.uncertainty == known.uncertainty
    assert apply(template, {"dc_resistivity": 100.0}).actuator.uncertainty is None
