"""The registry of couplings: files, bad input, the ladder of the fractional element."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.couplings import ChargeCoupling, Coupling, RelaxingCoupling, VoltageRelaxations
from ilg_circuit.strip.couplings.fractional import fractional_ladder
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import dumps, loads

LAWS = [
    ChargeCoupling(gain_1=92.31234567891e-9, time_1=5.1, gain_2=-30.5e-9, time_2=41.7, beam="static"),
    ChargeCoupling(instantaneous=-1e-9, odd=-0.25, even=0.125),
    VoltageRelaxations(fractional_gain=4e-8, fractional_time=7.0, fractional_exponent=0.6, gain_1=-2e-8, time_1=90.0),
]


@pytest.mark.parametrize("law", LAWS)
def test_files_are_lossless(law: RelaxingCoupling) -> None:
    strip = replace(PAPER, coupling=law)
    text = dumps(strip)
    assert f'kind = "{law.kind}"' in text
    assert loads(text) == strip
    assert loads(text).coupling.__class__ is law.__class__  # type: ignore[union-attr]


def test_gains_are_written_in_nanometres_a_volt() -> None:
    assert 'gain_2 = "-30.5 nm/V"' in dumps(replace(PAPER, coupling=LAWS[0]))


def test_a_file_without_a_kind_has_d_of_s_and_so_has_the_kind_voltage() -> None:
    text = dumps(PAPER)
    assert "kind" not in text
    assert loads(text.replace("[coupling]", '[coupling]\nkind = "voltage"')) == PAPER
    assert isinstance(PAPER.coupling, Coupling)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ('kind = "chage"', "choose one of voltage, charge, voltage-relaxations; perhaps charge"),
        ("kind = 3", "coupling.kind is '3'"),
        ('kind = "charge"', "has no gain"),
        ('kind = "charge"\ngain_1 = "3 nm/V"', "coupling.gain_1 is given and coupling.time_1 is not"),
        ('kind = "charge"\ntime_1 = "3 s"', "coupling.time_1 is given and coupling.gain_1 is not"),
        ('kind = "charge"\ngain_1 = "3 nm/V"\ntime_1 = "-3 s"', "coupling.time_1 is -3; it must be more than zero"),
        ('kind = "charge"\ngain = "3 nm/V"', "unknown key 'coupling.gain'"),
        (
            'kind = "charge"\nfractional_gain = "3 nm/V"\nfractional_time = "3 s"\nfractional_exponent = 1.0',
            "must be less than 1",
        ),
        ('kind = "charge"\nfractional_gain = "3 nm/V"\nfractional_time = "3 s"', "fractional_exponent is not"),
        ('kind = "voltage"\ngain = "3 m/(V s)"', "key 'coupling.zero' is missing"),
    ],
)
def test_what_is_wrong_with_a_section(wrong: str, said: str) -> None:
    text = dumps(replace(PAPER, coupling=None)) + f"\n[coupling]\n{wrong}\n"
    with pytest.raises(InputError, match=said):
        loads(text)


def test_values_of_a_coupling_are_changed_by_name() -> None:
    strip = replace(PAPER, coupling=LAWS[0])
    changed = strip.with_(gain_2="-10 nm/V", time_2=9.0).coupling
    assert isinstance(changed, ChargeCoupling)
    assert (changed.gain_2, changed.time_2, changed.gain_1) == (-10e-9, 9.0, LAWS[0].gain_1)
    with pytest.raises(InputError, match="coupling of kind 'charge', which has instantaneous"):
        strip.with_(zero=0.3)
    made = PAPER.with_(kind="charge", gain_1="90 nm/V", time_1="5 s").coupling
    assert made == ChargeCoupling(gain_1=90e-9, time_1=5.0)
    with pytest.raises(InputError, match="zero: it is a coupling of kind 'charge', which has instantaneous"):
        PAPER.with_(kind="charge", zero=0.3)
    with pytest.raises(
        InputError, match="a coupling of kind 'voltage' needs gain, damping_ratio, natural_frequency too"
    ):
        PAPER.with_(kind="voltage", zero=0.3)
    with pytest.raises(InputError, match="kind is 'chrge'; choose one of voltage, charge"):
        PAPER.with_(kind="chrge")
    with pytest.raises(InputError, match="coupling of kind 'voltage', which has gain, zero"):
        PAPER.with_(time_1=0.3)


@pytest.mark.parametrize("exponent", [0.1, 0.3, 0.5, 0.8, 0.97])
def test_the_fractional_ladder_is_as_good_as_it_says(exponent: float) -> None:
    ladder = fractional_ladder(exponent, 7.0)
    s = 2j * np.pi * np.geomspace(1e-4, 1e4, 333)
    ideal = 1 / (1 + (7.0 * s) ** exponent)
    weights, ratios = np.array(ladder.sections).T
    found = (weights / (1 + s[:, None] * 7.0 * ratios)).sum(axis=1)
    assert np.abs(found / ideal - 1).max() <= ladder.error * 1.05
    assert ladder.error < 2e-4
    assert weights.min() > 0
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)


def test_displacement_at_rest_by_charge_and_by_voltage() -> None:
    grown = PAPER.with_(capacitance_slope=0.5)
    by_charge: Actuator = replace(grown, coupling=ChargeCoupling(gain_1=1e-7, time_1=5.0))
    by_voltage = replace(grown, coupling=VoltageRelaxations(gain_1=1e-7, time_1=5.0))
    found = [lumped_elements(by_charge).steady(u) for u in (1.0, 2.0)]
    assert found[1] / found[0] == pytest.approx(2.4)
    assert lumped_elements(by_voltage).steady(2.0) == pytest.approx(10800 * 2e-7)
