"""Tables that are no load test are refused with what to do, and what a material does not describe is no success."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from gels import TWO, cycles, readings
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from strategies import log_floats

from ilg_circuit.cli import main
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.fit.misfit import FAIL, FAIL_WINDOW, WARN
from ilg_circuit.hyperelastic import MODES, LoadTest, Ogden, characterise

STRETCH = np.linspace(1.03, 3.5, 30)
SQUEEZED = np.linspace(0.98, 0.5, 20)

EXCHANGED = "the columns look exchanged"
STRAIN = "these look like strains: a strain of x is a stretch of 1 \\+ x"
PERCENT = "these look like strains in percent"
SIGN = "compression is negative and shortens: turn the sign of the stress"


def gel(modulus: float = 3e3) -> Ogden:
    return Ogden.from_moduli([modulus, modulus / 50], [1.7, 5.0])


# -- tables that are none ----------------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(
    modulus=log_floats(5e2, 3e6),
    unit=st.sampled_from([1.0, 1e3, 1e6]),
    mode=st.sampled_from(list(MODES)),
    farthest=st.floats(1.5, 6.0),
    seed=st.integers(0, 2**16),
)
def test_exchanged_columns_are_refused(modulus: float, unit: float, mode: str, farthest: float, seed: int) -> None:
    """The stretch written as stress in whatever unit, the stress as stretch: no fit is made of it."""
    stretch = np.linspace(1.02, farthest, 30)
    noise = 1 + 0.003 * np.random.default_rng(seed).standard_normal(len(stretch))
    stress = gel(modulus).nominal(mode, stretch) * noise
    with pytest.raises(InputError, match=EXCHANGED):
        LoadTest(mode, stress / unit, stretch * unit)


@pytest.mark.parametrize(
    ("stretch", "stress", "hint"),
    [
        (STRETCH - 1, gel().nominal("uniaxial", STRETCH), STRAIN),
        (np.r_[0, STRETCH - 1], np.r_[0, gel().nominal("uniaxial", STRETCH)], f"stretch 0: .*{STRAIN}"),
        (SQUEEZED - 1, gel().nominal("uniaxial", SQUEEZED), STRAIN),
        (1 - SQUEEZED, -gel().nominal("uniaxial", SQUEEZED), STRAIN),
        (100 * (STRETCH - 1), gel().nominal("uniaxial", STRETCH), PERCENT),
        (np.r_[0, 30 * (STRETCH - 1)], np.r_[0, gel().nominal("uniaxial", STRETCH)], PERCENT),
        (20 * (STRETCH - 1) + 1, gel().nominal("uniaxial", STRETCH), PERCENT),
        (100 * STRETCH, gel().nominal("uniaxial", STRETCH), "stretches in percent: name the column stretch_%"),
        (SQUEEZED, -gel().nominal("uniaxial", SQUEEZED), f"tensile stress .* below 1: .*{SIGN}"),
        (STRETCH, -gel().nominal("uniaxial", STRETCH), f"compressive stress .* above 1: .*{SIGN}"),
        (
            np.r_[SQUEEZED, STRETCH],
            np.abs(gel().nominal("uniaxial", np.r_[SQUEEZED, STRETCH])),
            f"at stretch 0.5, below 1.*{SIGN}",
        ),
        (gel().nominal("uniaxial", SQUEEZED), SQUEEZED, EXCHANGED),
        (
            STRETCH,
            1500 + gel().nominal("uniaxial", STRETCH),
            "point to a stress beyond .* at stretch 1, .*subtract the",
        ),
        (STRETCH, 1e3 * (4 - STRETCH), "point to a stress beyond .* at stretch 1"),
        (3 * STRETCH, gel().nominal("uniaxial", STRETCH), "none near 1: .*give the unloaded row"),
    ],
    ids=[
        *("strain", "strain from 0", "negative strain", "strain of compression", "percent", "percent from 0"),
        *("percent above 1", "stretch in percent", "compression positive", "tension negative", "sizes of stresses"),
        *("exchanged compression", "offset", "falling", "nowhere near 1"),
    ],
)
def test_what_is_no_stretch_is_refused_with_what_to_do(stretch: np.ndarray, stress: np.ndarray, hint: str) -> None:
    with pytest.raises(InputError, match=hint) as caught:
        LoadTest("uniaxial", stretch, stress, "pull.csv")
    assert str(caught.value).startswith("pull.csv: ")
    assert "\n" not in str(caught.value)


@settings(max_examples=40)
@given(
    modulus=log_floats(1e2, 1e7),
    alpha=st.floats(-6.0, 8.0),
    mode=st.sampled_from(list(MODES)),
    ends=st.one_of(st.tuples(st.just(1.02), st.floats(1.3, 5.0)), st.tuples(st.floats(0.5, 0.9), st.floats(1.1, 3.0))),
    seed=st.integers(0, 2**16),
)
def test_no_true_test_is_refused(modulus: float, alpha: float, mode: str, ends: tuple[float, float], seed: int) -> None:
    """Noise of 1 %, an offset of twice that, tension or both sides: all are taken as they are."""
    assume(abs(alpha) > 0.2)
    stretch = np.linspace(*ends, 25)
    stress = Ogden.from_moduli([modulus], [alpha]).nominal(mode, stretch)
    largest = np.abs(stress).max()
    assume(largest < 1e12)
    noise = 0.01 * largest * np.clip(np.random.default_rng(seed).standard_normal(25), -2, 2)
    test = LoadTest(mode, stretch, stress + noise + 0.02 * largest)
    assert len(test.stretch) >= 24


def test_far_stretches_are_taken_with_their_unloaded_row() -> None:
    stretch = np.linspace(1.0, 18.0, 30)
    test = LoadTest("uniaxial", stretch, gel().nominal("uniaxial", stretch))
    assert test.range == (1.0, 18.0)


# -- what a material does not describe ---------------------------------------------------------------------------------


def nonsense(seed: int, kind: str) -> LoadTest:
    random = np.random.default_rng(seed)
    stress = {
        "noise": np.abs(random.standard_normal(30)),
        "step": np.where(STRETCH > 2.0, 1.0, 0.02 * (STRETCH - 1)) + 0.01 * random.standard_normal(30),
        "waves": (STRETCH - 1) * (1 + np.sin(9 * STRETCH + seed)),
        "plateau": np.minimum((STRETCH - 1) / 0.1, 1.0) + 0.01 * random.standard_normal(30),
    }[kind]
    return LoadTest("uniaxial", STRETCH, 1e3 * stress)


@pytest.mark.parametrize(("kind", "seed"), [("noise", 1), ("noise", 2), ("step", 1), ("waves", 1), ("plateau", 1)])
def test_a_fit_that_explains_nothing_is_no_success(kind: str, seed: int) -> None:
    result = characterise([nonsense(seed, kind)])
    assert not result.success
    assert result.to_dict()["success"] is False
    assert "stress-not-described" in codes(result.findings)


@pytest.mark.parametrize(("noise", "success"), [(0.01, True), (0.07, True), (0.13, False)])
def test_misfit_is_the_rms_over_the_span_of_the_stress(noise: float, success: bool) -> None:
    test = readings(TWO, "uniaxial", noise=noise)[0]
    result = characterise([test], model="mooney-rivlin")
    misfit = result.fit.misfits[0]
    span = test.stress.max() - min(test.stress.min(), 0.0)
    assert misfit.share == pytest.approx(np.sqrt(np.mean(result.fit.residuals[0] ** 2)) / span)
    assert misfit.fail == (misfit.share > FAIL or misfit.worst > FAIL_WINDOW)
    assert result.success == success
    assert misfit.worst >= misfit.share
    shown = result.to_dict()["statistics"]["tests"]["uniaxial"]["misfit"]
    assert shown["worst"] == {"from": misfit.start, "to": misfit.end, "share": misfit.worst}


def test_a_misfit_that_is_no_noise_is_warned_of() -> None:
    """A neo-Hookean through a curve that stiffens; noise as large, fitted by the right model, is not warned of."""
    stretch = np.linspace(1.03, 2.6, 40)
    stress = Ogden.from_moduli([1000.0, 12.0], [1.8, 7.0]).nominal("uniaxial", stretch)
    simple = characterise([LoadTest("uniaxial", stretch, stress)], model="neo-hookean")
    assert WARN < simple.fit.misfits[0].share < FAIL
    assert simple.success
    told = next(f for f in simple.findings if f.code == "stress-misfit")
    assert told.values["share"] == simple.fit.misfits[0].share
    scatter = 0.04 * stress.max() * np.random.default_rng(4).standard_normal(40)
    noisy = characterise([LoadTest("uniaxial", stretch, stress + scatter)], terms=2)
    assert noisy.fit.misfits[0].share > WARN
    assert "stress-misfit" not in codes(noisy.findings)


def test_every_test_must_be_described() -> None:
    """One of three tests has stresses that are far too large; its own span counts, not the largest of all."""
    uniaxial, equibiaxial, planar = readings(TWO, noise=0.002)
    odd = LoadTest("planar", planar.stretch, 2.5 * planar.stress)
    result = characterise([uniaxial, equibiaxial, odd], terms=2)
    assert not result.success
    assert any(f.code == "stress-not-described" and f.values["test"] == "planar" for f in result.findings)
    assert characterise([uniaxial, equibiaxial, planar], terms=2).success


def test_a_modulus_that_nobody_knows_is_no_success() -> None:
    """Readings far from 1 alone: with two terms of free signs their sum at 1 is open."""
    stretch = np.linspace(3.0, 4.2, 9)
    stress = TWO.nominal("uniaxial", stretch) * (1 + 0.01 * np.random.default_rng(2).standard_normal(9))
    result = characterise([LoadTest("uniaxial", stretch, stress)], terms=2, constrained=False)
    assert 3 * result.fit.modulus_error > result.material.youngs_modulus
    assert not any(m.fail for m in result.fit.misfits)
    assert not result.success
    assert "modulus-unknown" in codes(result.findings)


# -- command -----------------------------------------------------------------------------------------------------------

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """`ilg-circuit ogden --uniaxial pull.csv` of these columns [1, kPa], with a strip to write."""
    monkeypatch.chdir(tmp_path)

    def call(stretch: np.ndarray, stress: np.ndarray, *arguments: str) -> tuple[int, str, str]:
        rows = "".join(f"{a!r},{b!r}\n" for a, b in zip(stretch.tolist(), stress.tolist(), strict=True))
        Path("pull.csv").write_text(f"stretch,stress_kPa\n{rows}")
        strip = ("--actuator", "paper", "--out", "strip.toml")
        with pytest.raises(SystemExit) as caught:
            main(["ogden", "--uniaxial", "pull.csv", *strip, *arguments])
        streams = capsys.readouterr()
        return int(caught.value.code or 0), streams.out, streams.err

    return call


def test_exchanged_columns_write_no_strip(run: Run) -> None:
    code, out, err = run(gel().nominal("uniaxial", STRETCH) / 1e4, STRETCH)
    assert (code, out) == (2, "")
    assert err.startswith("ilg-circuit: pull.csv: tensile stress")
    assert EXCHANGED in err
    assert len(err.splitlines()) == 1
    assert not Path("strip.toml").exists()


def test_no_success_writes_all_but_the_strip(run: Run) -> None:
    step = nonsense(1, "step").stress / 1e3
    code, out, err = run(STRETCH, step, "--terms", "1", "--json", "--plot", "p.png", "--report", "r.html")
    assert code == 1
    assert json.loads(out)["success"] is False
    assert "the fit is not a success (exit code 1), and no strip is written" in err
    assert not Path("strip.toml").exists()
    assert Path("p.png").stat().st_size > 0
    assert Path("r.html").stat().st_size > 0


def test_the_branch_is_an_option(run: Run) -> None:
    test = cycles(2.0, 2.0)
    code, out, err = run(test.stretch, test.stress / 1e3, "--branch", "unloading", "--terms", "1", "--json")
    assert code == 0, err
    assert json.loads(out)["statistics"]["n"] == 56
    assert "pull.csv: the order of its rows gives 29 loading, 56 unloading, 29 reloading; fitted: unloading" in err
    assert Path("strip.toml").exists()
