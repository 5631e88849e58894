"""Characterises a material from load tests: selects the number of terms, predicts all loads, and collects findings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, one_thread
from ..errors import InputError
from ..fit.selection import simplest_of_best
from ..measurements.load_test import LoadTest
from .characterisation import Characterisation, Instability, Prediction
from .diagnostics import (
    POINTS,
    on_branches,
    on_extrapolation,
    on_misfit,
    on_modes,
    on_modulus,
    on_stability,
    on_statistics,
)
from .fit import FIXED, MOST_TERMS, HyperelasticFit, fit_model
from .material import MODES
from .tangent import tangent_modulus

MODELS = ("auto", "ogden", *FIXED)

#: Largest stretch of a prediction, relative to the readings' largest, both as distances from 1 in logarithm.
_FARTHEST = 3.0


@one_thread()
def characterise(
    tests: Sequence[LoadTest],
    *,
    model: str = "auto",
    terms: int | None = None,
    constrained: bool = True,
    weighting: str = "absolute",
    at: ArrayLike = (),
    branch: str = "loading",
    seed: int = 0,
) -> Characterisation:
    """Return the material fitted to one to three tests of different modes.

    Parameters
    ----------
    model, terms
        auto: neo-Hookean, Mooney-Rivlin and Ogden with 1 to 4 terms are fitted, up to the first number of terms that
        the data do not determine, and the determined model of lowest BIC is chosen; ``terms`` selects an Ogden material
        with this number of terms.
    at
        Stretches of the predictions (default: the largest one measured).
    branch
        Branch of cyclic tests that is fitted: loading (the first loading, and stretches beyond all earlier ones),
        unloading, reloading or all; see `LoadTest.taking`.
    constrained, weighting, seed
        As `fit_model`.

    Raises
    ------
    InputError
        The tests, the model or the stretches cannot be used.
    """
    given = tuple(t.taking(branch) for t in tests)
    stretches = np.atleast_1d(np.asarray(at, dtype=float))
    if model == "auto" and terms is not None:
        model = "ogden"
    _require(given, model, terms, stretches)
    fit = partial(fit_model, given, constrained=constrained, weighting=weighting, seed=seed)
    candidates = _candidates(given, fit) if model == "auto" else (fit(model, terms),)
    if not candidates:
        raise InputError("one reading is too few for any material; give at least 2 readings at stretches other than 1")
    by_name = {f.name: f for f in candidates}
    # the neo-Hookean material comes first and is determined if any model is
    best = by_name[
        simplest_of_best(
            {name: f.bic for name, f in by_name.items()},
            {name: f.result.count for name, f in by_name.items()},
            [name for name, f in by_name.items() if not f.undetermined],
            evidence=0.0,
        )
    ]
    predictions = tuple(_predictions(best, stretches if len(stretches) else np.array([best.farthest])))
    instabilities = tuple(_instabilities(best))
    small = tangent_modulus(given)
    return Characterisation(
        fit=best,
        candidates=candidates,
        predictions=predictions,
        instabilities=instabilities,
        small_strain_modulus=small,
        findings=(
            *on_branches(given),
            *on_misfit(best),
            *on_modes(best),
            *on_stability(best, instabilities),
            *on_modulus(best, small),
            *on_statistics(best),
            *(on_extrapolation(predictions) if len(stretches) else ()),
        ),
        seed=seed,
    )


def _require(tests: Sequence[LoadTest], model: str, terms: int | None, stretches: Array) -> None:
    """Raise InputError for invalid tests or models, and for stretches far beyond the readings."""
    if not tests:
        raise InputError(f"no test was given; give at least one of {', '.join(MODES)}")
    modes = [t.mode for t in tests]
    if len(set(modes)) < len(modes):
        raise InputError(f"two tests are {next(m for m in modes if modes.count(m) > 1)}; put their rows into one file")
    if model not in MODELS:
        raise InputError(f"model is '{model}'; choose {', '.join(MODELS)}")
    if model == "ogden" and terms is None:
        raise InputError(f"an Ogden fit needs its number of terms, 1 to {MOST_TERMS}; auto chooses one")
    farthest = max(float(np.abs(np.log(t.stretch)).max()) for t in tests)
    low, high = np.exp(-_FARTHEST * farthest), np.exp(_FARTHEST * farthest)
    for stretch in stretches.tolist():
        if not low <= stretch <= high:
            raise InputError(
                f"stretch {stretch:g} to predict at is far beyond the readings; give one from {low:.3g} to {high:.3g}"
            )


def _candidates(
    tests: Sequence[LoadTest], fit: Callable[[str, int | None], HyperelasticFit]
) -> tuple[HyperelasticFit, ...]:
    """Return fits of all models with enough readings, up to the first number of terms that is not determined."""
    readings = sum(len(t.stretch) for t in tests)
    found = [fit(model, None) for model, alphas in FIXED.items() if readings > len(alphas)]
    for terms in range(1, MOST_TERMS + 1):
        if readings <= 2 * terms:
            break
        found.append(fit("ogden", terms))
        if terms > 1 and found[-1].undetermined:  # more terms cannot be determined if these are not
            break
    return tuple(found)


def _predictions(fit: HyperelasticFit, stretches: Array) -> Iterator[Prediction]:
    covered = {t.mode: t.range for t in fit.tests}
    for mode in MODES:
        for stretch in stretches.tolist():
            nominal = float(fit.material.nominal(mode, stretch))
            inside = mode in covered and covered[mode][0] <= stretch <= covered[mode][1]
            error = fit.nominal_error(mode, stretch)
            yield Prediction(mode, stretch, nominal, stretch * nominal, error, inside)


def _instabilities(fit: HyperelasticFit) -> Iterator[Instability]:
    stretch = np.geomspace(*fit.stretch_range, POINTS)
    for mode in MODES:
        stiffnesses = {"drucker": fit.material.hardening(mode, stretch), "slope": fit.material.slope(mode, stretch)}
        for kind, stiffness in stiffnesses.items():
            wrong = stretch[~(stiffness > 0)]
            if len(wrong):
                yield Instability(mode, kind, float(wrong[0]), float(wrong[-1]))
