"""One model fitted to a spectrum: right values, honest errors, nothing claimed that the data do not hold."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic import noisy_factor

import ilg_circuit as ilg
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.fit import fitting
from ilg_circuit.fit.identifiability import DETERMINED
from ilg_circuit.identification import identify, impedance
from ilg_circuit.identification.impedance import ImpedanceData, Weighting
from ilg_circuit.identification.open_path import DC
from ilg_circuit.identification.port_fit import PortFit
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.strip.models import ElectricalModel, electrical_model

F = np.geomspace(1e-3, 1e4, 61)
TRUTHS = {
    "rc": ((233.0, 6.8, 0.02), 1.0),
    "rc2": ((400.0, 20.0, 0.01, 100.0, 0.02), 2.0),
    "rc3": ((1000.0, 10.0, 0.001, 50.0, 0.01, 100.0, 0.1), 0.0),
    "warburg": ((300.0, 10.0, 50.0, 2.0), 2.0),
    "cpe": ((1000.0, 10.0, 0.02, 0.8), 0.0),
}


def spectrum(model: str, noise: float = 0.0, seed: int = 0, f: NDArray[np.float64] = F) -> Spectrum:
    values, held = TRUTHS[model]
    z = electrical_model(model).port(values, held).impedance(2j * np.pi * f, ideal=True)
    return Spectrum(model, f, z * noisy_factor(len(f), noise, seed))


def fit_spectrum(
    z: Spectrum, model: str, held: float = 0.0, *, weighting: Weighting = "modulus", seed: int = 0
) -> PortFit:
    """The port from a spectrum, of whose search the seed is given."""
    data = ImpedanceData.of(z, weighting=weighting)
    only = data.individual(electrical_model(model), held, None, seed)
    return PortFit(only.model, (only.data,), (only,), only.fit, only.fixed, only.unfelt)


def relative_rms(found: PortFit) -> float:
    (data,) = found.data
    assert isinstance(data, ImpedanceData)
    return data.relative_rms(found.fit.residuals_of(0))


@pytest.mark.parametrize("model", TRUTHS)
def test_many_sets_at_once_are_the_port(model: str) -> None:
    kind = electrical_model(model)
    values, held = TRUTHS[model]
    sets = np.array(values) * np.random.default_rng(1).uniform(0.5, 1.2, (5, len(values)))
    s = 2j * np.pi * F
    expected = np.array([kind.port(v.tolist(), held).impedance(s, ideal=True) for v in sets])
    assert kind.impedance(sets, s, held) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("model", TRUTHS)
@pytest.mark.parametrize("weighting", ["modulus", "unit", "proportional"])
def test_clean_spectra_give_the_truth(model: str, weighting: Weighting) -> None:
    values, held = TRUTHS[model]
    found = fit_spectrum(spectrum(model), model, held, weighting=weighting)
    assert list(found.values.values()) == pytest.approx(values, rel=1e-6)
    assert found.fixed == {}
    assert relative_rms(found) < 1e-8
    assert found.identifiability().determined


@pytest.mark.parametrize("model", TRUTHS)
def test_any_seed_gives_the_same(model: str) -> None:
    first, second = (fit_spectrum(spectrum(model, 0.01, 3), model, TRUTHS[model][1], seed=s) for s in (0, 7))
    assert second.fit.values == pytest.approx(first.fit.values, rel=1e-5)
    assert second.fit.errors == pytest.approx(first.fit.errors, rel=1e-3)
    assert first.fit.starts.agreeing >= 2


@pytest.mark.parametrize("model", TRUTHS)
def test_intervals_hold_the_truth(model: str) -> None:
    """Over 16 spectra: 95 % of all parameters' intervals, within what chance allows (parameters move together)."""
    values, held = TRUTHS[model]
    hits, parts = [], []
    for seed in range(16):
        found = fit_spectrum(spectrum(model, 0.005, seed), model, held)
        ends = found.fit.intervals
        hits.append((ends[:, 0] <= values) & (values <= ends[:, 1]))
        parts.append((found.fit.values / values - 1) / (found.fit.errors / found.fit.values))
    assert 0.86 <= np.mean(hits) <= 1
    assert np.std(parts) == pytest.approx(1.0, abs=0.25)
    assert abs(np.mean(parts)) < 0.4


def test_statistics_are_those_of_the_textbook() -> None:
    found = fit_spectrum(spectrum("rc", 0.01), "rc", 1.0)
    kind, values, s = electrical_model("rc"), found.fit.values, 2j * np.pi * F
    z = spectrum("rc", 0.01).impedance
    residuals = z - kind.impedance(values[None], s, 1.0)[0]
    assert found.data[0].shown(found.fit.residuals_of(0)) == pytest.approx(residuals, abs=1e-9)
    squares = float(np.sum(np.abs(residuals / z) ** 2))
    n, k = 2 * len(F), 3
    assert relative_rms(found) == pytest.approx(np.sqrt(squares / n))
    assert found.fit.aic == pytest.approx(n * np.log(squares / n) + 2 * k)
    assert found.fit.bic == pytest.approx(n * np.log(squares / n) + np.log(n) * k)
    # covariance from a Jacobian of its own, in the parameters themselves
    columns = []
    for j in range(3):
        step = np.zeros(3)
        step[j] = 1e-6 * values[j]
        ahead, behind = kind.impedance(np.array([values + step, values - step]), s, 1.0) / np.abs(z)
        columns.append((ahead - behind) / (2 * step[j]))
    jacobian = np.array(columns).T
    jacobian = np.concatenate([jacobian.real, jacobian.imag])
    covariance = squares / (n - k) * np.linalg.inv(jacobian.T @ jacobian)
    assert found.fit.errors == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-4)
    assert found.fit.correlations[0, 1] == pytest.approx(
        covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]), abs=1e-3
    )
    from scipy.stats import t

    low, high = found.fit.intervals[2]
    assert np.sqrt(low * high) == pytest.approx(values[2])
    half = float(t.ppf(0.975, n - k)) * found.fit.errors[2] / values[2]
    assert np.log(high / low) / 2 == pytest.approx(half)


@pytest.mark.parametrize("model", ["rc", "rc2", "warburg", "cpe"])
def test_an_open_electron_path_is_said_and_bounded(model: str) -> None:
    values, held = TRUTHS[model]
    kind = electrical_model(model)
    f = np.geomspace(1e-2, 1e4, 41)
    z = kind.port((1e7, *values[1:]), held).impedance(2j * np.pi * f, ideal=True)
    z = z * noisy_factor(41, 0.003, 2)
    found = fit_spectrum(Spectrum("s", f, z), model, held)
    assert "open circuit, more than" in found.fixed[DC]
    assert found.identifiability().determined
    assert found.values[DC] == pytest.approx(1e6 * np.abs(z).max())
    assert DC not in found.fit.labels
    assert found.fit.values == pytest.approx(values[1:], rel=0.1)


def test_what_follows_from_an_open_path_alone_has_no_error() -> None:
    kind, f = electrical_model("rc"), np.geomspace(1e-2, 1e4, 41)
    z = kind.port((1e7, 6.8, 0.02)).impedance(2j * np.pi * f) * noisy_factor(41, 0.003, 2)
    derived = identify(Spectrum("s", f, z), model="rc").derived
    steady = derived["steady_resistance"]
    assert (steady.stderr, steady.ci95) == (None, None)
    assert steady.fixed_because.startswith("as dc_resistance: no electron path")
    assert derived["time_constant"].stderr


def test_a_visible_electron_path_is_not_called_open() -> None:
    for seed in range(5):
        found = fit_spectrum(spectrum("warburg", 0.02, seed), "warburg", 2.0)
        assert found.values["dc_resistance"] == pytest.approx(300.0, rel=0.1)


def test_the_bound_of_an_open_path_is_right() -> None:
    """95 times in a hundred a true Rdc lies above the least resistance that is stated (here within chance)."""
    kind, f = electrical_model("rc"), np.geomspace(1, 1e4, 41)
    truth = 2000.0
    z = kind.port((truth, 6.8, 0.02)).impedance(2j * np.pi * f)
    said = []
    for seed in range(45):
        text = fit_spectrum(Spectrum("s", f, z * noisy_factor(41, 0.01, seed)), "rc").fixed.get(DC, "")
        if text:
            number, unit = text.split("more than ")[1].split()[:2]
            said.append(float(number) * {"ohm": 1.0, "kohm": 1e3}[unit] <= truth)
    assert len(said) > 30
    assert np.mean(said) > 0.85


def test_what_is_not_felt_is_held_and_named() -> None:
    found = fit_spectrum(spectrum("rc", 0.003), "rc2", 1.0)
    judgement = found.identifiability()
    assert not judgement.determined
    assert judgement.reason.startswith(("no effect on the data", f"standard error over {DETERMINED:.0%}"))
    one = fit_spectrum(spectrum("rc", 0.003), "cpe", 1.0)
    assert one.unfelt == one.identifiability().unfelt == ("cpe_exponent",)
    assert 0.999 < one.values["cpe_exponent"] < 1


def test_branches_come_by_ascending_time_constant() -> None:
    found = fit_spectrum(spectrum("rc3", 0.002), "rc3")
    constants = [r * c for r, c in found.port.branches]
    assert constants == sorted(constants)


def test_re_trades_against_rdc_rd_and_c() -> None:
    """One pole: four elements, three observables. Another Re fits as well, with other values."""
    a, b = (fit_spectrum(spectrum("rc", 0.003), "rc", re) for re in (1.0, 5.0))
    assert relative_rms(b) == pytest.approx(relative_rms(a), rel=1e-6)
    assert b.values["dynamic_resistance"] < 0.6 * a.values["dynamic_resistance"]


@pytest.mark.parametrize(
    ("model", "held", "said"),
    [
        ("rc+sinh", 0.0, "does not show emission_voltage"),
        ("rc2+growing", 0.0, "does not show capacitance_slope"),
        ("nonsense", 0.0, "choose one of"),
        ("rc", -1.0, "zero or more"),
        ("rc", np.nan, "zero or more"),
        ("rc", 9.0, "too large: the real part falls to 7.6"),
    ],
)
def test_wrong_input(model: str, held: float, said: str) -> None:
    with pytest.raises(InputError, match=said):
        fit_spectrum(spectrum("rc"), model, held)


def test_wrong_weighting_and_too_few_points() -> None:
    nonsense: Any = "none"
    with pytest.raises(InputError, match="weighting is 'none'"):
        fit_spectrum(spectrum("rc"), "rc", weighting=nonsense)
    few = replace(ImpedanceData.of(spectrum("rc3")), spectrum=spectrum("rc3", f=F[:4]))
    with pytest.raises(InputError, match="4 points are too few for model rc3"):
        few.individual(electrical_model("rc3"), 0.0, None)


def test_no_convergence_is_no_success(monkeypatch: pytest.MonkeyPatch) -> None:
    """With one evaluation allowed, and starts far away, the answer is an error and not the last point."""

    def far(kind: ElectricalModel, *_: object) -> NDArray[np.float64]:
        return np.tile(1e3 * np.array(TRUTHS[kind.name][0]), (60, 1))

    monkeypatch.setattr(ElectricalModel, "spectrum_starts", far)
    monkeypatch.setattr(impedance, "_EVALUATIONS", 1)
    monkeypatch.setattr(fitting, "MOST_EVALUATIONS", 1)
    with pytest.raises(SolveError, match=r"did not converge|diverged|determine|did not return"):
        fit_spectrum(spectrum("rc2", 0.01), "rc2", 2.0)


def test_an_electron_path_that_is_not_seen_widens_the_others() -> None:
    """R and C were those of an open circuit in narrow intervals: of the sets that show no path R held in none of 12."""
    frequency = np.logspace(2, -2, 17)
    true = {"dynamic_resistance": 20.0, "capacitance": 0.35}
    z = 1 / (1 / 2000 + 1 / (20 + 1 / (2j * np.pi * frequency * 0.35)))
    held = count = 0
    for seed in range(20):
        random = np.random.default_rng(seed)
        noisy = z * (1 + 0.01 * (random.standard_normal(17) + 1j * random.standard_normal(17)))
        found = ilg.identify({"frequency_Hz": frequency, "re_ohm": noisy.real, "im_ohm": noisy.imag}, model="rc")
        if found["dc_resistance"].interval is not None:
            continue
        for name, value in true.items():
            low, high = found[name].interval or (np.nan, np.nan)
            held += low <= value <= high
            count += 1
    assert count >= 12
    assert held >= count - 2
