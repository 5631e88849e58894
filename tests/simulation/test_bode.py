"""The frequency response of a strip: against the port's rational function, its law's slope, and the covariance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run
from numpy.testing import assert_allclose

import ilg_circuit as ilg
from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import PAPER, Actuator, Uncertainty
from ilg_circuit.strip.couplings import ChargeCoupling, CouplingLaw
from ilg_circuit.strip.elements import lumped_elements

CHARGE = ChargeCoupling(gain_1=90e-9, time_1=5.0, gain_2=-30e-9, time_2=40.0)
F = np.geomspace(1e-3, 10.0, 13)


@pytest.mark.parametrize("law", [PAPER.coupling, CHARGE], ids=["voltage", "charge"])
def test_it_is_the_ports_rational_function(law: CouplingLaw) -> None:
    strip = replace(PAPER, coupling=law)
    lumped, s = lumped_elements(strip), 2j * np.pi * F
    factor = np.array([lumped.coupling_factor(x) for x in s])
    ion, dc = lumped.port.ion_impedance(s), lumped.port.dc_resistance
    compliance, inertia = lumped.stiffness / s, lumped.mass * s + lumped.damping
    free = compliance * inertia / (compliance + inertia)
    found = ilg.bode(strip, frequency=F, beam="dynamic")
    assert_allclose(found.displacement, factor * free / (ion + factor**2 * free) / inertia / s, rtol=1e-9)
    assert_allclose(found.current, 1 / dc + 1 / (ion + factor**2 * free), rtol=1e-9)
    assert_allclose(found.force, factor * compliance / (ion + factor**2 * compliance), rtol=1e-9)
    static = ilg.bode(strip, frequency=F, beam="static")
    assert_allclose(static.displacement, factor / ion / s, rtol=1e-9)
    assert_allclose(static.force, lumped.stiffness * static.displacement, rtol=1e-9)


def test_bandwidth_and_peak() -> None:
    one = replace(PAPER, coupling=ChargeCoupling(gain_1=90e-9, time_1=1e-3))
    found = ilg.bode(one, "0.1 mHz", "1 Hz", points=401, beam="static")
    # the charge follows by Rd C = 6.8 s
    assert found.bandwidth == pytest.approx(1 / (2 * np.pi * 6.802721), rel=1e-3)
    assert found.peak[0] == found.frequency[0]
    assert ilg.bode(one, "0.1 mHz", "1 mHz", beam="static").bandwidth is None


def test_about_a_bias_it_is_the_slope_of_the_law() -> None:
    strip = replace(PAPER.with_(capacitance_slope=0.3), coupling=CHARGE)
    slow = ilg.bode(strip, frequency=[1e-6], bias="2 V", beam="static").displacement[0]
    lumped = lumped_elements(strip)
    assert slow.real == pytest.approx((lumped.steady(2.0001) - lumped.steady(1.9999)) / 2e-4, rel=1e-6)
    by_ngspice = ilg.bode(strip, frequency=F, bias=2.0, beam="static", engine="ngspice")
    assert_allclose(by_ngspice.displacement, ilg.bode(strip, frequency=F, bias=2.0, beam="static").displacement,
                    rtol=1e-5)  # fmt: skip


def uncertain() -> Actuator:
    """A strip whose gain is known to 5 % and whose resistance to 2 %."""
    names = ("dc_resistance", "dynamic_resistance", "capacitance", "coupling_gain")
    covariance = np.diag([0.0, 0.02**2, 0.0, 0.05**2])
    return replace(PAPER, uncertainty=Uncertainty("rc", names, tuple(map(tuple, covariance.tolist()))))


def test_its_band_follows_from_the_covariance() -> None:
    found = ilg.bode(uncertain(), frequency=F, beam="static", band=True)
    # the displacement is d(s) u: its gain's error is all of it, and moves no phase
    assert_allclose(found.stderr["displacement"].real, 0.05, rtol=1e-6)
    assert_allclose(found.stderr["displacement"].imag, 0.0, atol=1e-9)
    # d log Y/d log Rd = -Rd (i/u through the ions) (1/Zp)/Y
    s, port = 2j * np.pi * F, lumped_elements(PAPER).port
    ((r, c),) = port.branches
    ions = 1 / (r + 1 / (c * s))
    slope = -r * ions**2 / (ions + 1 / port.dc_resistance)
    assert_allclose(found.stderr["current"], 0.02 * (np.abs(slope.real) + 1j * np.abs(slope.imag)), rtol=1e-5)
    assert {"displacement_stderr_m/V", "current_phase_stderr_deg"} <= set(found.columns())


def test_what_cannot_be_says_so() -> None:
    with pytest.raises(InputError, match=r"has no \[coupling\], so its motion has no response"):
        ilg.bode(replace(PAPER, coupling=None))
    with pytest.raises(InputError, match=r"has no \[uncertainty\]: fit one with identify"):
        ilg.bode("paper", band=True)
    with pytest.raises(InputError, match="all positive and finite"):
        ilg.bode("paper", frequency=[0.0, 1.0])


def test_the_command(run: Run) -> None:
    uncertain().save("strip.toml")
    done = run("bode", "strip.toml", "--to", "1Hz", "--band", "--out", "bode.csv", "--plot", "bode.svg")
    assert done.code == 0, done.err
    assert "bandwidth of the displacement: " in done.out
    assert "+- 5 %" in done.out
    head = Path("bode.csv").read_text(encoding="utf-8").splitlines()[0]
    assert head.startswith("frequency_Hz,displacement_m/V,displacement_phase_deg,displacement_stderr_m/V")
    assert Path("bode.svg").stat().st_size > 10_000
