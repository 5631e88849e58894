"""Strips with changed values: texts and numbers, errors, and the same answer as a study's variation."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import PAPER, Actuator, Sensing, Uncertainty
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.study.parameters import ScenarioTemplate, apply

FITTED = replace(PAPER, uncertainty=Uncertainty("rc", ("capacitance",), ((0.01,),)))


def test_texts_with_units_and_si_numbers() -> None:
    changed = PAPER.with_(
        thickness="0.4 mm", youngs_modulus=9e3, gain="3e-9 m/(V s)", orientation="horizontal", name="thin"
    )
    assert changed.geometry == replace(PAPER.geometry, thickness=0.4e-3)
    assert changed.material == replace(PAPER.material, youngs_modulus=9e3)
    assert changed.coupling == replace(PAPER.coupling, gain=3e-9)
    assert (changed.mounting.orientation, changed.name) == ("horizontal", "thin")
    assert PAPER.geometry.thickness == 0.5e-3
    assert PAPER.with_() == PAPER


@pytest.mark.parametrize(
    "values",
    [
        {"thickness": 0.4e-3},
        {"free_length": 20e-3},
        {"permittivity": 2.0, "width": 4e-3},
        {"zero": 0.3, "orientation": "hanging"},
    ],
)
def test_the_same_strip_as_a_study_makes(values: Mapping[str, Any], strips: dict[str, Actuator]) -> None:
    for strip in (PAPER, FITTED, strips["load inside"], strips["rc2"]):
        assert strip.with_(**values) == apply(ScenarioTemplate(strip, "step:4V", 1.0), values).actuator


def test_elements_of_a_fitted_strip_follow_its_sizes_and_its_covariance_its_constants() -> None:
    before, after = (lumped_elements(s) for s in (FITTED, FITTED.with_(thickness="0.25 mm")))
    assert after.port.dc_resistance == pytest.approx(before.port.dc_resistance / 2)
    assert after.port.branches[0][1] == pytest.approx(2 * before.port.branches[0][1])
    assert after.stiffness == pytest.approx(before.stiffness / 8)
    assert after.coupling == before.coupling
    assert FITTED.with_(thickness="0.25 mm", orientation="hanging").uncertainty == FITTED.uncertainty
    assert FITTED.with_(permittivity="1.1 F/m").uncertainty is None
    assert FITTED.with_(gain=2e-9).uncertainty is None


def test_keys_of_other_models_and_branches(strips: dict[str, Actuator]) -> None:
    assert PAPER.with_(cpe_exponent=0.8).material.model.name == "cpe"
    assert strips["rc2"].with_(permittivity_2="0.5 F/m").material.further_branches[0].permittivity == 0.5
    assert PAPER.with_(beam="static").coupling.beam == "static"  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"thicknes": 1e-3}, "unknown key 'thicknes'; perhaps thickness"),
        ({"thickness": "1 kg"}, "thickness: unit 'kg' does not measure this quantity; use 'm' or a multiple of it"),
        ({"thickness": "1"}, "thickness: '1' has no unit"),
        ({"thickness": True}, "thickness is 'True'; give a number in m"),
        ({"thickness": None}, "thickness is 'None'; give a number in m"),
        ({"thickness": [1e-3]}, "give a number in m"),
        ({"thickness": float("nan")}, "thickness is nan; give a finite value"),
        ({"thickness": -1e-3}, "geometry.thickness is -0.001; it must be more than zero"),
        ({"free_length": 1.0, "length": 0.5}, "the free part cannot exceed the whole"),
        ({"orientation": "upside down"}, "choose one of weightless, hanging, horizontal"),
        ({"permittivity_2": 1.0}, "permittivity_2 belongs to ionic branch 2, and 'paper' has 1"),
        ({"name": 3}, "name is '3'; give a text"),
    ],
)
def test_what_cannot_be_is_one_line(values: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        PAPER.with_(**values)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_coupling_to_change(strips: dict[str, Actuator]) -> None:
    with pytest.raises(InputError, match=r"gain: actuator 'no coupling' has no \[coupling\]"):
        strips["no coupling"].with_(gain=1e-9)


def test_a_strip_prints_as_a_table(strips: dict[str, Actuator]) -> None:
    for strip in (*strips.values(), FITTED, replace(PAPER, name="two\nlines")):
        lines = repr(strip).splitlines()
        assert len(lines) <= 20
        assert "  geometry   length                  35 mm" in lines
        assert any("thickness               500 um" in line for line in lines)
        assert max(map(len, lines)) <= 100
        assert "total thickness b" in strip._repr_html_()
    assert "not known" in repr(strips["no coupling"])


def test_a_long_strip_says_how_much_more_there_is(strips: dict[str, Actuator]) -> None:
    branch = strips["rc2"].material.further_branches[0]
    long = replace(strips["rc2 electrodes"].material, further_branches=(branch, branch), bending_stiffness=1e-9)
    lines = repr(replace(PAPER, material=long)).splitlines()
    assert len(lines) == 20
    assert lines[-1] == "  and 3 more"


def test_strips_pickle_and_copy(strips: dict[str, Actuator]) -> None:
    for strip in (*strips.values(), FITTED):
        assert pickle.loads(pickle.dumps(strip)) == strip
        assert copy.deepcopy(strip) == strip


def test_a_law_of_sensing_is_given_by_its_keys() -> None:
    strip = PAPER.with_(sensing={"instantaneous": 3.0, "gain_1": "-2 V", "time_1": "4 s"})
    assert strip.sensing == Sensing(instantaneous=3.0, gain_1=-2.0, time_1=4.0)
    assert strip.with_(width="4 mm").sensing == strip.sensing
    assert strip.with_(sensing=None).sensing is None
    with pytest.raises(InputError, match=r"unknown key 'sensing.gain_9'"):
        PAPER.with_(sensing={"gain_9": 1.0})
