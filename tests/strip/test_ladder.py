"""Ladders against the elements that they stand for, within the error and the band that they state."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import log_floats

from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.ladder import LADDER_ERROR, Ladder, Ladders
from ilg_circuit.strip.models.cpe import CPE, cpe_impedance
from ilg_circuit.strip.models.warburg import WARBURG, warburg_impedance

decades = st.floats(0.5, 8.0)
counts = st.one_of(st.none(), st.integers(1, 200))


def cpe_ladder(coefficient: float, exponent: float, band: tuple[float, float], sections: int | None = None) -> Ladder:
    return CPE.ladder((coefficient, exponent), Ladders(band, sections))


def warburg_ladder(
    resistance: float, tau: float, band: tuple[float, float], sections: int | None = None, reach: float | None = None
) -> Ladder:
    return WARBURG.ladder((resistance, tau), Ladders(band, sections, reach))


def band_of(low: float, wide: float) -> tuple[float, float]:
    return low, low * 10**wide


def off_scan(band: tuple[float, float], seed: int) -> np.ndarray:
    """Frequencies within the band where the package does not look, both ends included."""
    inside = np.exp(np.random.default_rng(seed).uniform(*np.log(band), 200))
    return 2j * np.pi * np.concatenate([[band[0]], inside, [band[1]]])


def assert_keeps_its_word(ladder: Ladder, ideal: np.ndarray, s: np.ndarray) -> None:
    true = (np.abs(ladder.impedance(s) - ideal) / np.abs(ideal)).max()
    assert true <= ladder.error
    assert ladder.error <= 3 * true + 1e-9, "far more than the true error is no statement either"


# -- within the stated error -------------------------------------------------------------------------------------------


@given(log_floats(1e-2, 1e5), log_floats(1e-3, 1e5), log_floats(1e-6, 1e3), decades, counts)
def test_warburg(resistance: float, tau: float, low: float, wide: float, sections: int | None) -> None:
    band = band_of(low, wide)
    ladder = warburg_ladder(resistance, tau, band, sections)
    assert ladder.band == band
    s = off_scan(band, 1)
    x = np.sqrt(s * tau)
    # cosh/sinh themselves overflow for large x, where coth is 1
    coth = np.where(x.real > 20, 1.0, 1 / np.tanh(np.minimum(x.real, 20) + 1j * x.imag))
    assert_keeps_its_word(ladder, resistance * coth / x, s)


@given(log_floats(1e-6, 1e3), st.floats(0.02, 0.98), log_floats(1e-6, 1e3), decades, counts)
def test_cpe(coefficient: float, exponent: float, low: float, wide: float, sections: int | None) -> None:
    band = band_of(low, wide)
    ladder = cpe_ladder(coefficient, exponent, band, sections)
    assert ladder.band == band
    s = off_scan(band, 2)
    assert_keeps_its_word(ladder, 1 / (coefficient * s**exponent), s)


@given(log_floats(1e-3, 1e5), log_floats(1e-6, 1e3), decades)
def test_a_warburg_ladder_takes_as_many_sections_as_it_needs(tau: float, low: float, wide: float) -> None:
    assert warburg_ladder(50.0, tau, band_of(low, wide)).error <= 1.03 * LADDER_ERROR


@given(st.floats(0.2, 0.95), log_floats(1e-6, 1e3), decades)
def test_a_cpe_ladder_takes_as_many_sections_as_it_needs(exponent: float, low: float, wide: float) -> None:
    assert cpe_ladder(0.1, exponent, band_of(low, wide)).error <= LADDER_ERROR


@settings(max_examples=30)
@given(st.booleans(), st.floats(0.2, 0.9), st.integers(4, 80), st.integers(1, 100))
def test_more_sections_are_never_much_worse(warburg: bool, exponent: float, few: int, more: int) -> None:
    few_, many = (
        (warburg_ladder(50.0, 20.0, (1e-4, 1e3), n) if warburg else cpe_ladder(0.2, exponent, (1e-4, 1e3), n)).error
        for n in (few, few + more)
    )
    assert many <= 1.3 * few_ + 2e-5


def test_every_doubling_pays() -> None:
    for errors in (
        [warburg_ladder(50.0, 20.0, (1e-4, 1e3), n).error for n in (5, 10, 20, 40, 80)],
        [cpe_ladder(0.2, 0.7, (1e-4, 1e3), n).error for n in (3, 6, 12, 24)],
    ):
        assert all(b < 0.8 * a for a, b in itertools.pairwise(errors)), errors


# -- what a ladder is made of ------------------------------------------------------------------------------------------


@given(st.booleans(), log_floats(1e-2, 1e3), st.floats(0.05, 0.95), counts)
def test_every_element_is_positive(warburg: bool, size: float, exponent: float, sections: int | None) -> None:
    """Passive, so that it can be built and cannot run away."""
    band = (1e-4, 1e3)
    ladder = warburg_ladder(size, 20.0, band, sections) if warburg else cpe_ladder(size, exponent, band, sections)
    assert 1 <= len(ladder.sections) <= (sections or 200)
    assert ladder.resistance > 0
    assert ladder.capacitance > 0
    assert all(r > 0 and c > 0 for r, c in ladder.sections)


@given(log_floats(1e-2, 1e3), log_floats(1e-2, 1e4))
def test_a_warburg_ladder_has_the_elements_own_limits(resistance: float, tau: float) -> None:
    """At low frequency the capacitance tau/Rw behind Rw/3: the sum of 2 Rw/(k pi)^2 over all modes, none forgotten."""
    ladder = warburg_ladder(resistance, tau, (1e-4, 1e3))
    assert ladder.capacitance == pytest.approx(tau / resistance, rel=1e-12)
    assert ladder.resistance + sum(r for r, _ in ladder.sections) == pytest.approx(resistance / 3, rel=1e-4)


@given(log_floats(0.1, 10.0), log_floats(0.1, 10.0))
def test_warburg_ladders_of_one_reach_are_scaled_copies(resistance: float, time: float) -> None:
    """A fit that moves Rw and tau then sees a smooth function."""
    one = warburg_ladder(1.0, 1.0, (1e-4, 1e3), 20, reach=1e5)
    other = warburg_ladder(resistance, time, (1e-4 / time, 1e3 / time), 20, reach=1e5)
    s = 1j * np.geomspace(1e-3, 1e3, 20)
    assert other.impedance(s / time) == pytest.approx(resistance * one.impedance(s), rel=1e-9)


def test_ladders_in_the_band_s_middle_have_the_phase_of_a_cpe() -> None:
    ladder = cpe_ladder(0.2, 0.7, (1e-3, 1e3))
    phase = np.degrees(np.angle(ladder.impedance(2j * np.pi * np.geomspace(1e-3, 1e3, 50))))
    assert phase == pytest.approx(np.full(50, -63.0), abs=0.01)


@given(log_floats(1e-12, 1e12))
def test_the_closed_form_of_warburg_has_both_limits(product: float) -> None:
    z = complex(warburg_impedance(1j * product, 2.0, 1.0))
    if product < 1e-4:
        assert z == pytest.approx(2.0 * (1 / (1j * product) + 1 / 3), rel=1e-6)
    if product > 1e4:
        assert z == pytest.approx(2.0 / np.sqrt(1j * product), rel=1e-6)
    assert z.real > 0
    assert z.imag < 0


def test_a_cpe_between_capacitor_and_resistor() -> None:
    assert complex(cpe_impedance(2j, 0.5, 1.0)) == pytest.approx(1 / 1j)
    assert complex(cpe_impedance(2j, 0.5, 1e-12)) == pytest.approx(2.0, rel=1e-10)


@given(st.floats(0.0, 1.0), log_floats(1e-3, 1e3))
def test_a_cpe_of_one_half_is_a_warburg_element_that_never_ends(part: float, tau: float) -> None:
    """Far above 1/tau the finite element is Rw/sqrt(s tau): a CPE with Q = sqrt(tau)/Rw, a = 1/2."""
    s = 1j * 10 ** (3 + 3 * part) / tau
    assert complex(warburg_impedance(s, 7.0, tau)) == pytest.approx(complex(cpe_impedance(s, tau**0.5 / 7.0, 0.5)))


# -- refused -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sections", [0, -1, 201])
def test_sections_that_make_no_ladder(sections: int) -> None:
    for make in (
        lambda: warburg_ladder(1.0, 1.0, (1.0, 10.0), sections),
        lambda: cpe_ladder(1.0, 0.5, (1.0, 10.0), sections),
    ):
        with pytest.raises(InputError, match=f"a ladder of {sections} sections: give 1 to 200"):
            make()


@pytest.mark.parametrize("band", [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (-1.0, 1.0), (math.nan, 1.0), (1.0, math.inf)])
def test_bands_that_are_none(band: tuple[float, float]) -> None:
    for make in (lambda: warburg_ladder(1.0, 1.0, band), lambda: cpe_ladder(1.0, 0.5, band)):
        with pytest.raises(InputError, match="give two positive frequencies, the lower first"):
            make()


@pytest.mark.parametrize("exponent", [0.0, 1.0, 1.5, -0.5, math.nan])
def test_exponents_of_no_cpe(exponent: float) -> None:
    with pytest.raises(InputError, match="must lie between 0 and 1"):
        cpe_ladder(1.0, exponent, (1.0, 10.0))


def test_material_fields_say_what_is_wrong() -> None:
    m = PAPER.material
    for fields, hint in (
        ({"diffusion_time": 5.0, "ladder_sections": 0.0}, "ladder_sections is 0; give a whole number from 1 on"),
        ({"diffusion_time": 5.0, "ladder_sections": 2.5}, "ladder_sections is 2.5; give a whole number"),
        ({"cpe_exponent": 1.0}, "cpe_exponent is 1; it must be less than 1"),
        ({"cpe_exponent": 0.0}, "cpe_exponent is 0; it must be more than zero"),
        ({"cpe_exponent": 0.5, "diffusion_time": 1.0}, "more than one ion path"),
        ({"cpe_exponent": 0.5, "capacitance_slope": 0.1}, "capacitance_slope goes with R-C branches, not with cpe_ex"),
        ({"ladder_lowest": 1.0, "ladder_highest": 1.0}, "ladder_lowest 1 Hz must be less than ladder_highest 1 Hz"),
        ({"ladder_lowest": 1e6}, "must be less than ladder_highest"),
        ({"emission_voltage": 0.0}, "emission_voltage is 0; it must be more than zero"),
        ({"bending_stiffness": -1.0}, "bending_stiffness is -1; it must be more than zero"),
        ({"diffusion_time": math.inf}, "diffusion_time is inf; give a finite value"),
    ):
        with pytest.raises(InputError, match=hint):
            replace(m, **fields)
