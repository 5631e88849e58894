"""Load tests -> material: the number of terms chosen, and what the result cannot be trusted with said in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..fit.criteria import autocorrelation
from ..measurements.load_test import LoadTest
from ..units import format_quantity
from .fit import FIXED, MOST_TERMS, HyperelasticFit, describe, fit_model
from .material import MODES, Ogden

Array = NDArray[np.float64]

MODELS = ("auto", "ogden", *FIXED)

#: Equibiaxial over uniaxial stress at one stretch: rubbers and gels have 1 to 3, and 2 at the start.
_ABSURD = 10.0
#: Strains up to here are small: the stress is then set by E, and by little else.
_SMALL = 0.2
#: The fitted E and that of the small strains alone should not differ by more than this part.
_E_DIFFERS = 0.1
#: Predictions are made up to this many times as far from stretch 1, by logarithm, as there are readings.
_FARTHEST = 3.0
#: Residuals below this part of the largest stress are rounding, whatever their pattern.
_ROUNDING = 1e-5
#: A range of stretches is followed at this many points for instability and absurdity.
_POINTS = 400


@dataclass(frozen=True)
class Prediction:
    """Nominal and Cauchy stress [Pa] of one mode at one stretch.

    ``error`` is the nominal stress's standard error, NaN where the data do not determine it; ``measured`` tells
    whether a test of this mode covers the stretch.
    """

    mode: str
    stretch: float
    nominal: float
    cauchy: float
    error: float
    measured: bool


@dataclass(frozen=True)
class Instability:
    """Where a mode is unstable: stretches from ``low`` to ``high`` within the data's range.

    ``kind``: "slope" (the nominal stress does not rise with the stretch) or "drucker" (nor does the Kirchhoff stress
    with the logarithmic strain).
    """

    mode: str
    kind: str
    low: float
    high: float


@dataclass(frozen=True)
class Characterisation:
    """The fit that was chosen, those it was chosen from, and warnings.

    ``small_strain_modulus`` is E [Pa] by the readings at small strains alone, with its standard error; None where
    there are too few.
    """

    fit: HyperelasticFit
    candidates: tuple[HyperelasticFit, ...]
    predictions: tuple[Prediction, ...]
    instabilities: tuple[Instability, ...]
    small_strain_modulus: tuple[float, float] | None
    warnings: tuple[str, ...]

    @property
    def material(self) -> Ogden:
        return self.fit.material

    @property
    def tests(self) -> tuple[LoadTest, ...]:
        return self.fit.tests


def characterise(
    tests: Sequence[LoadTest],
    *,
    model: str = "auto",
    terms: int | None = None,
    constrained: bool = True,
    weighting: str = "absolute",
    at: ArrayLike = (),
    seed: int = 0,
) -> Characterisation:
    """Fit a material to one to three tests of different modes.

    ``model`` auto: neo-Hookean, Mooney-Rivlin and Ogden with 1 to 4 terms are fitted, up to the first number of terms
    that the data do not determine, and the one with the lowest BIC is taken among those that they do; ``terms`` asks
    for an Ogden material of that many.
    Predictions are made at the stretches ``at``, or else at the farthest stretch measured. Other arguments as
    `fit_model`.
    """
    given = tuple(tests)
    if not given:
        raise InputError(f"no test was given; give at least one of {', '.join(MODES)}")
    modes = [t.mode for t in given]
    if len(set(modes)) < len(modes):
        raise InputError(f"two tests are {next(m for m in modes if modes.count(m) > 1)}; put their rows into one file")
    if model not in MODELS:
        raise InputError(f"model is '{model}'; choose {', '.join(MODELS)}")
    if model == "auto" and terms is not None:
        model = "ogden"
    if model == "ogden" and terms is None:
        raise InputError(f"an Ogden fit needs its number of terms, 1 to {MOST_TERMS}; auto chooses one")
    _check_stretches(at, given)

    def fit(m: str, n: int | None) -> HyperelasticFit:
        return fit_model(given, m, n, constrained=constrained, weighting=weighting, seed=seed)

    candidates = _climb(given, fit) if model == "auto" else (fit(model, terms),)
    if not candidates:
        raise InputError("one reading is too few for any material; give at least 2 readings at stretches other than 1")
    # the neo-Hookean comes first and is determined whenever anything is
    chosen = min([f for f in candidates if not f.undetermined] or candidates[:1], key=lambda f: f.bic)
    predictions = _predictions(chosen, at)
    instabilities = tuple(_instabilities(chosen))
    small = _small_strain_modulus(given)
    return Characterisation(
        fit=chosen,
        candidates=candidates,
        predictions=predictions,
        instabilities=instabilities,
        small_strain_modulus=small,
        warnings=(
            *_on_modes(chosen),
            *_on_stability(chosen, instabilities),
            *_on_start(chosen, small),
            *_on_statistics(chosen),
            *_on_extrapolation(predictions, at),
        ),
    )


def whole_range(tests: Sequence[LoadTest]) -> tuple[float, float]:
    """Smallest and largest stretch of all tests, 1 included."""
    return min(t.range[0] for t in tests), max(t.range[1] for t in tests)


def absurd_from(material: Ogden, high: float) -> float | None:
    """Stretch up to ``high`` from which the equibiaxial stress is over ten times the uniaxial; None if it never is.

    In tension only: a sheet pressed in its plane carries far more than a pressed column, and rightly.
    """
    stretch = np.geomspace(1.0, high, _POINTS)[1:] if high > 1 else np.empty(0)
    ratio = material.nominal("equibiaxial", stretch) / material.nominal("uniaxial", stretch)
    wild = np.flatnonzero(~(np.abs(ratio) <= _ABSURD))
    return float(stretch[wild[0]]) if len(wild) else None


def _climb(tests: Sequence[LoadTest], fit: Callable[[str, int | None], HyperelasticFit]) -> tuple[HyperelasticFit, ...]:
    """Fits of all models that there are readings enough for, up to the first number of terms that is too many."""
    readings = sum(len(t.stretch) for t in tests)
    climbed = [fit(model, None) for model, alphas in FIXED.items() if readings > len(alphas)]
    for terms in range(1, MOST_TERMS + 1):
        if readings <= 2 * terms:
            break
        climbed.append(fit("ogden", terms))
        if terms > 1 and climbed[-1].undetermined:  # what two or more terms leave open, one more leaves opener
            break
    return tuple(climbed)


def _check_stretches(at: ArrayLike, tests: Sequence[LoadTest]) -> None:
    """Refuse stretches that are none, or so far beyond the readings that a prediction would be a mere power of them."""
    farthest = max(float(np.abs(np.log(t.stretch)).max()) for t in tests)
    low, high = np.exp(-_FARTHEST * farthest), np.exp(_FARTHEST * farthest)
    for stretch in np.atleast_1d(np.asarray(at, dtype=float)).tolist():
        if not low <= stretch <= high:
            raise InputError(
                f"stretch {stretch:g} to predict at is far beyond the readings; give one from {low:.3g} to {high:.3g}"
            )


def _predictions(fit: HyperelasticFit, at: ArrayLike) -> tuple[Prediction, ...]:
    low, high = whole_range(fit.tests)
    stretches = np.atleast_1d(np.asarray(at, dtype=float))
    if not len(stretches):
        stretches = np.array([_farthest(low, high)])
    covered = {t.mode: t.range for t in fit.tests}
    result = []
    for mode in MODES:
        start, end = covered.get(mode, (1.0, 1.0))
        for stretch in stretches.tolist():
            nominal = float(fit.material.nominal(mode, stretch))
            error = fit.nominal_error(mode, stretch)
            inside = mode in covered and start <= stretch <= end
            result.append(Prediction(mode, stretch, nominal, stretch * nominal, error, inside))
    return tuple(result)


def _farthest(low: float, high: float) -> float:
    return high if high * low >= 1 else low


def _instabilities(fit: HyperelasticFit) -> list[Instability]:
    low, high = whole_range(fit.tests)
    stretch = np.geomspace(low, high, _POINTS)
    found = []
    for mode in MODES:
        for kind, values in (
            ("slope", fit.material.slope(mode, stretch)),
            ("drucker", fit.material.hardening(mode, stretch)),
        ):
            wrong = stretch[~(values > 0)]
            if len(wrong):
                found.append(Instability(mode, kind, float(wrong[0]), float(wrong[-1])))
    return found


def _small_strain_modulus(tests: Sequence[LoadTest]) -> tuple[float, float] | None:
    """E and its standard error [Pa] by a neo-Hookean material through the readings below 20 % strain alone."""
    basis, stress = [], []
    for t in tests:
        small = np.abs(t.stretch - 1) <= _SMALL
        basis.append(Ogden.neo_hookean(1.0).nominal(t.mode, t.stretch[small]))
        stress.append(t.stress[small])
    b, p = np.concatenate(basis), np.concatenate(stress)
    if len(b) < 3:
        return None
    g = float(b @ p) / float(b @ b)
    error = float(np.sqrt(((p - g * b) ** 2).sum() / (len(b) - 1) / (b @ b)))
    return (3 * g, 3 * error) if g > 0 else None


# -- warnings ----------------------------------------------------------------------------------------------------------


def _on_modes(fit: HyperelasticFit) -> list[str]:
    """What a fit says of the kinds of load that were not tested: the figure itself, so that everyone can judge it."""
    modes = [t.mode for t in fit.tests]
    low, high = whole_range(fit.tests)
    farthest = _farthest(low, high)
    wild = absurd_from(fit.material, high) if "equibiaxial" not in modes else None
    if len(modes) > 1 and wild is None:
        return []
    shown = "uniaxial" if modes == ["equibiaxial"] else "equibiaxial"
    text = (
        f"fitted to the {modes[0]} test alone, which does not tell how the material answers other loads: "
        if len(modes) == 1
        else "no equibiaxial test was given: "
    )
    value, there = (_pascal(float(fit.material.nominal(mode, farthest))) for mode in (shown, modes[0]))
    text += f"at stretch {farthest:.3g} it predicts {value} {shown} ({modes[0]}: {there})"
    if wild is not None:
        text += (
            f"; that is absurd, from stretch {wild:.3g} on the equibiaxial stress is over {_ABSURD:.0f} times the "
            "uniaxial: do not use it there"
        )
    lines = [f"{text}; fit it jointly with --{shown}"]
    if modes == ["planar"]:
        mirrored = Ogden(tuple(-m for m in fit.material.mu), tuple(-a for a in fit.material.alpha))
        lines.append(
            "a planar test cannot tell alpha from -alpha: with all signs turned the fit is the same, but the "
            f"equibiaxial stress at stretch {farthest:.3g} is "
            f"{_pascal(float(mirrored.nominal('equibiaxial', farthest)))}"
        )
    return lines


def _on_stability(fit: HyperelasticFit, found: tuple[Instability, ...]) -> list[str]:
    lines = []
    for mode in MODES:
        drucker = next((i for i in found if i.mode == mode and i.kind == "drucker"), None)
        slope = next((i for i in found if i.mode == mode and i.kind == "slope"), None)
        parts = []
        if drucker is not None:
            parts.append(
                f"Drucker's condition fails between stretch {drucker.low:.3g} and {drucker.high:.3g}, where no "
                "simulation will converge"
            )
        if slope is not None:
            parts.append(
                f"the nominal stress does not rise with the stretch (dP/dl <= 0) between {slope.low:.3g} and "
                f"{slope.high:.3g}, where a dead load runs away"
            )
        if parts:
            lines.append(f"unstable in {mode} load: {'; '.join(parts)}")
    if not fit.material.shear_modulus > 0:
        lines.append(f"the shear modulus is {_pascal(fit.material.shear_modulus)}: no material has that")
    return lines


def _on_start(fit: HyperelasticFit, small: tuple[float, float] | None) -> list[str]:
    """E is the slope at stretch 1: whether readings are near it, and whether the fit follows them."""
    nearest = min(float(np.abs(t.stretch - 1).min()) for t in fit.tests)
    modulus = fit.material.youngs_modulus
    if nearest > 0.501 * _SMALL:
        return [
            f"extrapolation: the nearest reading to stretch 1 is {nearest:.2g} away, so E and G, the slopes at 1, are "
            "extrapolated; measure smaller stretches"
        ]
    if small is None:
        return []
    # beyond what either is known to, and by enough to matter
    doubt = 2 * float(np.hypot(small[1], 3 * np.nan_to_num(fit.modulus_error)))
    if abs(modulus - small[0]) > max(doubt, _E_DIFFERS * small[0]):
        advice = "" if fit.weighting == "relative" else "; --weights relative follows them"
        return [
            f"E is {_pascal(modulus)} by the fit, {_pascal(small[0])} by the readings below {_SMALL:.0%} strain alone: "
            f"take the latter for a strip that strains little{advice}"
        ]
    return []


def _on_statistics(fit: HyperelasticFit) -> list[str]:
    lines = [f"{describe(fit.model, fit.terms)}: {reason}; take a simpler model" for reason in fit.undetermined]
    for test, residuals in zip(fit.tests, fit.residuals, strict=True):
        correlation = autocorrelation(residuals)
        if np.abs(residuals).max() < _ROUNDING * np.abs(test.stress).max():
            continue
        if correlation > max(0.3, 2.5 / np.sqrt(len(residuals))):
            lines.append(
                f"the {test.mode} residuals are not noise (neighbours correlate by {correlation:.2f}): the model "
                "misses part of the curve, and standard errors are too small"
            )
    if fit.starts > 1 and fit.agreeing == 1 and not fit.undetermined:
        lines.append(
            f"only one of {fit.starts} starts ended here: there may be a better fit; try another number of terms"
        )
    return lines


def _on_extrapolation(predictions: tuple[Prediction, ...], at: ArrayLike) -> list[str]:
    if not np.size(at):
        return []
    lines = []
    for mode in MODES:
        beyond = [f"{p.stretch:.4g}" for p in predictions if p.mode == mode and not p.measured]
        if beyond:
            lines.append(f"extrapolation: no {mode} reading reaches stretch {', '.join(beyond)}")
    return lines


def _pascal(value: float) -> str:
    return format_quantity(value, "Pa", 4)
