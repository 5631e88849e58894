"""Frequency responses from records: the port's rational function within bands, which hold for 200 sets; errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run, assert_one_line

import ilg_circuit as ilg
from ilg_circuit.arrays import Array
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.identification.excitation import Sines, Sweep, excitation
from ilg_circuit.identification.spectral import Lines, periods, polynomials

STEP, SETS, NOISE = 0.25, 200, 0.02


def measured(
    drive: Any, duration: float, *, rest: float = 0.0, step: float = STEP
) -> tuple[Array, Array, Array, Array]:
    """Time, voltage, displacement and current of the paper's strip, after a rest."""
    run = ilg.simulate("paper", drive, times=np.arange(0, duration, step), engine="exact", beam="static")
    still = np.zeros(round(rest / step))
    rows = [np.r_[still, row] for row in (run.voltage, run.displacement, run.current)]
    return np.arange(len(rows[0])) * step, rows[0], rows[1], rows[2]


def columns(t: Array, u: Array, y: Array, i: Array, noise: float = 0.0, seed: int = 0) -> dict[str, Array]:
    random = np.random.default_rng(seed)
    found = {"displacement_m": y, "current_A": i}
    noisy = {k: x + noise * np.abs(x).max() * random.standard_normal(len(x)) for k, x in found.items()}
    return {"time_s": t, "voltage_V": u, **noisy}


def covered(found: Lines) -> Array:
    """For each frequency, the part of the sets whose circle about the response holds the true one."""
    from scipy.stats import f

    true = ilg.bode("paper", frequency=found.frequency, beam="static").displacement
    radius = np.sqrt(f.ppf(0.95, 2, 2 * found.freedom) * found.variance)
    return np.asarray((np.abs(found.response - true) <= radius).mean(axis=0))


@pytest.fixture(scope="module")
def chirp() -> tuple[Array, Array, Array, Array]:
    return measured("chirp:1V,20mHz..0.5Hz", 400.0, rest=20.0)


def test_bands_cover_200_sets(chirp: tuple[Array, Array, Array, Array]) -> None:
    random = np.random.default_rng(1)
    _, u, y, _ = chirp
    noisy = y[80:] + NOISE * np.abs(y).max() * random.standard_normal((SETS, len(y) - 80))
    found = polynomials(STEP, u[80:], noisy, np.geomspace(0.02, 0.4, 14), 80)
    shares = covered(found)
    assert 0.93 < shares.mean() < 0.98
    assert shares.min() > 0.85
    t, u, y, _ = measured("multisine:1V,20mHz..0.2Hz,6", 300.0)
    tones = excitation(t, u, "")
    assert isinstance(tones, tuple)
    assert tones[0].period == pytest.approx(50.0, rel=1e-3)
    noisy = y + NOISE * np.abs(y).max() * random.standard_normal((SETS, len(y)))
    lines, _ = periods(t, u, noisy, tones[0].frequency, 50.0, skip=50.0)
    assert len(lines.frequency) == len(tones[0].frequency)
    assert 0.93 < covered(lines).mean() < 0.98


def test_a_chirp_gives_the_strip_back_within_its_band(chirp: tuple[Array, Array, Array, Array]) -> None:
    found = ilg.bode_of(columns(*chirp, NOISE), "paper", beam="static")
    assert found.excited == {"record": "sweep"}
    assert len(found.frequency) == 14
    assert sum(found.outside("displacement")) <= 3
    assert not codes(found.findings)
    model = ilg.bode("paper", frequency=found.frequency, beam="static")
    assert found.bandwidth == pytest.approx(model.bandwidth, rel=0.05)
    assert found.coherence["current"].max() > 0.999 > found.coherence["displacement"][-1]
    # the beam's mass changes the motion by far more than the band: it is named
    other = ilg.bode_of(columns(*chirp, NOISE / 10), "paper", beam="dynamic")
    assert "model-outside-band" in codes(other.findings)
    assert np.array_equal(other.outside("displacement"), other.to_dict()["bode"]["displacement_model_outside"])


def test_without_noise_it_is_the_rational_function(chirp: tuple[Array, Array, Array, Array]) -> None:
    found = ilg.bode_of(columns(*chirp), "paper", "30 mHz", "0.35 Hz", beam="static")
    assert found.model is not None
    np.testing.assert_allclose(found.responses["current"], found.model.current, rtol=1e-3)
    np.testing.assert_allclose(found.responses["displacement"], found.model.displacement, rtol=5e-3)


def test_sines_together_in_turn_and_alone() -> None:
    tones = [0.02, 0.05, 0.1, 0.3]
    edges = np.cumsum([0, *(8 / f for f in tones)])
    t = np.arange(0, edges[-1], 0.05)
    k = np.searchsorted(edges, t, side="right") - 1
    drive = (t, 0.5 + np.sin(2 * np.pi * np.array(tones)[k] * (t - edges[k])))
    random = np.random.default_rng(2)
    at, u, y, i = measured(drive, edges[-1], step=0.05)
    kept = np.sort(random.choice(len(at), len(at) // 2, replace=False))  # uneven steps
    found = ilg.bode_of(columns(at[kept], u[kept], y[kept], i[kept]), "paper", beam="static", bias=0.0)
    assert found.excited == {"record": "steps of sines"}
    np.testing.assert_allclose(found.frequency, tones, rtol=1e-3)
    assert found.bias == pytest.approx(0.5, abs=1e-3)
    assert found.model is not None
    np.testing.assert_allclose(found.responses["displacement"], found.model.displacement, rtol=0.02)
    alone = [columns(*measured(f"sine:1V,{f}Hz", 12 / f, step=0.05 / f)) for f in (0.05, 0.2)]
    turned = [each | {"displacement_m": -each["displacement_m"]} for each in alone]
    pair = ilg.bode_of(turned, "paper", beam="static")
    assert pair.source == ("record 1", "record 2")
    assert "displacement-axis-reversed" in codes(pair.findings)
    assert pair.model is not None
    np.testing.assert_allclose(pair.responses["displacement"], pair.model.displacement, rtol=5e-3)


def test_noise_is_told_from_a_sweep() -> None:
    random = np.random.default_rng(3)
    t = np.arange(0, 400, 0.5)
    at, u, y, i = measured((t, np.convolve(random.standard_normal(len(t)), np.ones(4) / 4, "same")), 400.0)
    assert isinstance(excitation(at, u, ""), Sweep)
    found = ilg.bode_of(columns(at, u, y, i), "paper", "30 mHz", "0.3 Hz", beam="static")
    assert found.excited == {"record": "noise"}
    assert found.model is not None
    assert np.median(np.abs(found.responses["current"] / found.model.current - 1)) < 0.01
    assert isinstance(excitation(at, np.sin(0.4 * at), "")[0], Sines)  # type: ignore[index]


T = np.arange(0, 100, 0.25)
SINE = {"time_s": T, "voltage_V": np.sin(0.5 * T), "displacement_mm": np.cos(0.5 * T)}


@pytest.mark.parametrize(
    ("record", "says"),
    [
        (SINE | {"voltage_V": np.sin(np.expm1(0.05 * T))}, "too short for its lowest frequency"),
        (SINE | {"voltage_V": 0 * T}, "no excitation: the voltage stays at 0 V"),
        ({k: SINE[k] for k in ("time_s", "voltage_V")} | {"current_mA": T}, "the displacement is missing"),
        (SINE | {"voltage_V": 2.0 * (T > 10)}, "the voltage moves within 2 readings only, as in a step"),
        (SINE | {"voltage_V": np.sign(np.sin(0.5 * T))}, "the voltage jumps 16 times"),
        ({k: v[:75] for k, v in SINE.items()}, "holds 1.5 periods of 12.5. s; two are needed"),
        ({k: v[:9] for k, v in SINE.items()}, "9 readings; a response needs 32"),
        (SINE | {"displacement_mm": np.where(T > 50, np.nan, T)}, "of 400 readings of the displacement are blank"),
    ],
)
def test_what_is_wrong_is_one_line(record: dict[str, Array], says: str) -> None:
    with pytest.raises(InputError, match=says):
        ilg.bode_of(record)


def test_the_command(run: Run, tmp_path: Path, chirp: tuple[Array, Array, Array, Array]) -> None:
    file, table = tmp_path / "chirp.csv", tmp_path / "bode.csv"
    rows = columns(*chirp, NOISE)
    np.savetxt(file, np.column_stack(list(rows.values())), delimiter=",", header=",".join(rows), comments="")
    done = run("bode", "paper", "--beam", "static", "--record", str(file), "--from", "30mHz", "--out", str(table))
    assert done.code == 0, done.err
    assert "outside the band at" in done.out
    head, first = table.read_text(encoding="utf-8").splitlines()[:2]
    assert head.startswith("frequency_Hz,displacement_m/V,displacement_phase_deg,displacement_band_m/V")
    assert float(first.split(",")[0]) == pytest.approx(0.03, rel=0.05)
    assert_one_line(run("bode", "paper", "--skip", "1s"), "--skip goes with --record")
    assert_one_line(run("bode"), "give a strip, such as paper, or a record")
    assert_one_line(run("bode", "--record", str(file), "--band"), "--band does not go with --record")
