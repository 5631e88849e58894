"""Exact circuits pass the check, whatever they are made of and however they were rounded; bad readings do not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ilg_circuit.identification.kramers_kronig import kramers_kronig, last_digit
from ilg_circuit.measurements.spectrum import Spectrum

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]


def rounded(z: Complex, digits: int) -> Complex:
    """``z`` as a file gives it."""
    return np.array([complex(float(f"{v.real:.{digits - 1}e}"), float(f"{v.imag:.{digits - 1}e}")) for v in z])


def warburg(s: Complex, tau: float) -> Complex:
    x = np.sqrt(s * tau)
    x.real = np.minimum(x.real, 300.0)
    return np.asarray(1 / (np.tanh(x) * x))


def random_circuit(f: Floats, seed: int) -> Complex:
    """A series of R, L, C, CPE, Zarc, finite and infinite Warburg elements, Randles circuits and ladders of two."""
    random, s = np.random.default_rng(seed), 2j * np.pi * f
    z = np.full(len(f), 10 ** random.uniform(-2, 0), dtype=complex)
    for kind in random.choice(8, size=random.integers(1, 4)):
        size, exponent = 10 ** random.uniform(-1.3, 1.3), random.uniform(0.5, 1)
        tau, other = np.exp(random.uniform(-np.log(abs(s[-1]) * 3), -np.log(abs(s[0]) / 3), size=2))
        z += (
            size
            * (
                1 / (1 + s * tau),
                1 / (1 + (s * tau) ** exponent),
                1 / (s * tau) ** exponent,
                1 / (s * tau),
                warburg(s, tau),
                1 / np.sqrt(s * tau),
                1 / (1 / (1 + size * warburg(s, other)) + (s * tau) ** exponent),
                1 / (1 / (1 + 1 / (s * tau)) + 1 / (size * (1 + (s * other) ** -exponent))),
            )[kind]
        )
    if random.random() < 0.4:
        z += s / abs(s[-1]) * abs(z[-1]) * random.uniform(0.01, 0.8)
    return z


def band(a_decade: int, decades: float) -> Floats:
    return np.asarray(1e-2 * 10 ** (np.arange(int(a_decade * decades) + 1) / a_decade))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(5, 12), st.floats(3, 6), st.integers(2, 6))
def test_exact_circuits_pass(seed: int, a_decade: int, decades: float, digits: int) -> None:
    f = band(a_decade, decades)
    found = kramers_kronig(Spectrum("s", f, rounded(random_circuit(f, seed), digits)))
    assert not found.bad.any()
    assert found.consistent


def constant_phase_chain() -> Spectrum:
    f = np.geomspace(0.1, 1e5, 73)
    s = 2j * np.pi * f
    z = 95 + 1 / (1 / 1100 + 2e-5 * s**0.72) + 1 / (1.05e-4 * s**0.86)
    return Spectrum("s", f, rounded(z, 4))


def test_constant_phase_elements_of_four_digits_pass() -> None:
    found = kramers_kronig(constant_phase_chain())
    assert found.consistent
    assert not found.bad.any()
    assert found.rms < 2e-4, "rounding alone"


def test_few_unknowns_are_free_although_the_grid_is_dense() -> None:
    found = kramers_kronig(constant_phase_chain())
    assert found.terms > 60
    assert found.freedom < 40 < 2 * len(found.frequency) / 3


def test_an_inductance_in_parallel_passes_by_the_admittance() -> None:
    f = np.geomspace(1, 1e5, 51)
    s = 2j * np.pi * f
    exact = 1 / (1 / 50 + 1 / (10 + s * 0.05) + s * 1e-6)
    assert kramers_kronig(Spectrum("s", f, rounded(exact, 5))).consistent


# -- what breaks the relations -----------------------------------------------------------------------------------------

SPECTRA = 60


@pytest.fixture(scope="module")
def spectra() -> list[tuple[Floats, Complex, np.random.Generator]]:
    """Random circuits with noise of 0 to 0.3 %."""
    made = []
    for seed in range(SPECTRA):
        random = np.random.default_rng([seed, 1])
        f = band(int(random.integers(5, 13)), random.uniform(3, 6))
        noise = random.choice([0.0, 1e-3, 3e-3]) * (random.standard_normal((2, len(f))))
        made.append((f, random_circuit(f, seed) * (1 + noise[0] + 1j * noise[1]), random))
    return made


Spectra = list[tuple[Floats, Complex, np.random.Generator]]


@pytest.mark.parametrize(("size", "least"), [(0.05, 0.9), (0.1, 0.95), (0.3, 0.97)])
def test_a_reading_that_is_off_is_named_and_no_other(spectra: Spectra, size: float, least: float) -> None:
    exactly = 0
    for f, z, random in spectra:
        at = int(random.integers(2, len(f) - 2))
        off = np.where(np.arange(len(f)) == at, 1 + size * np.exp(2j * np.pi * random.random()), 1.0)
        bad = np.flatnonzero(kramers_kronig(Spectrum("s", f, rounded(z * off, 4))).bad).tolist()
        assert set(bad) <= {at}
        exactly += bad == [at]
    assert exactly >= least * SPECTRA


def test_a_jump_is_found_and_no_reading_blamed(spectra: Spectra) -> None:
    told = 0
    for f, z, random in spectra:
        at = int(random.integers(len(f) // 4, 3 * len(f) // 4))
        found = kramers_kronig(Spectrum("s", f, rounded(np.where(np.arange(len(f)) < at, 1.1 * z, z), 4)))
        assert not found.bad.any()
        told += not found.consistent
    assert told >= 0.95 * SPECTRA


@pytest.mark.parametrize("noise", [1e-3, 5e-3, 0.02])
def test_noise_is_no_reason_to_leave_a_reading_out(spectra: Spectra, noise: float) -> None:
    for f, z, random in spectra:
        parts = noise * random.standard_normal((2, len(f)))
        found = kramers_kronig(Spectrum("s", f, rounded(z * (1 + parts[0] + 1j * parts[1]), 3)))
        assert not found.bad.any()


def test_noise_that_grows_leaves_its_readings_in() -> None:
    """The low end is noisy: its readings are no exceptions among their neighbours."""
    named = 0
    for seed in range(30):
        random, f = np.random.default_rng(seed), band(8, 5)
        noise = 1e-3 * 10 ** (1.5 * (1 - np.linspace(0, 1, len(f))) ** 2) * random.standard_normal((2, len(f)))
        found = kramers_kronig(Spectrum("s", f, rounded(random_circuit(f, seed) * (1 + noise[0] + 1j * noise[1]), 4)))
        named += bool(found.bad.any())
    assert named <= 2


# -- the digits of a file ----------------------------------------------------------------------------------------------


def test_the_last_digit_is_seen() -> None:
    z = np.array([123.4 - 2.345j, 1.002 - 0.01234j])
    assert last_digit(z) == pytest.approx(np.hypot([0.1, 0.001], [0.001, 1e-5]) / 2 / np.abs(z))
    decimals = np.array([123.456 - 0.012j, 1.25 - 0.101j])
    assert last_digit(decimals) == pytest.approx(np.hypot(1e-3, 1e-3) / 2 / np.abs(decimals))
