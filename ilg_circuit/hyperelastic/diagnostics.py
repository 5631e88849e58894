"""Findings on a hyperelastic fit: branches, misfit, loads not tested, stability, E, residuals, extrapolation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..errors import argument
from ..findings import Finding
from ..fit.criteria import autocorrelation
from ..measurements.branches import RELOADING, UNLOADING, area_shares
from ..measurements.load_test import LoadTest
from .characterisation import Instability, Prediction
from .fit import ROUNDING, HyperelasticFit
from .material import MODES, Ogden
from .tangent import SMALL

#: A range of stretches is followed at this many points for instability and absurdity.
POINTS = 400

#: Equibiaxial over uniaxial stress at one stretch: rubbers and gels have 1 to 3, and 2 at the start.
_ABSURD = 10.0
#: Largest relative difference of the fitted E and the E of small strains alone, and the number of their joint standard
#: errors from which a difference counts.
_E_DIFFERS, _E_ERRORS = 0.1, 2.5
#: Unloading that does more work than loading, reloading that does less, by this part does so beyond noise.
_GAINED = 0.02


def absurd_from(material: Ogden, high: float) -> float | None:
    """Return the stretch up to ``high`` from which the equibiaxial stress is over ten times the uniaxial; else None.

    In tension only: a sheet pressed in its plane carries far more than a pressed column, and rightly.
    """
    stretch = np.geomspace(1.0, high, POINTS)[1:] if high > 1 else np.empty(0)
    ratio = material.nominal("equibiaxial", stretch) / material.nominal("uniaxial", stretch)
    wild = np.flatnonzero(~(np.abs(ratio) <= _ABSURD))
    return float(stretch[wild[0]]) if len(wild) else None


def on_branches(tests: Sequence[LoadTest]) -> Iterator[Finding]:
    """Yield what branches the rows of a test are, which were fitted, and how far they lie apart."""
    for test in tests:
        if not test.ordered:
            yield Finding("rows-unordered", test.source)
        if len(test.legs) < 2:
            continue
        counts = test.counts
        values: dict[str, Any] = {"counts": [f"{count} {kind}" for kind, count in counts.items()]}
        values |= {"rows": counts, "taken": test.branch, "fitted": len(test.stretch)}
        if len(counts) > 1:
            yield Finding("branches", test.source, values)
        else:
            yield Finding("loading-repeated", test.source, values | {"times": len(test.legs)})
        shares = area_shares(test.legs)
        if UNLOADING in shares:
            share = shares[UNLOADING]
            yield Finding("hysteresis" if share >= -_GAINED else "work-gained", test.source, {"share": abs(share)})
        if shares.get(RELOADING, 0.0) > _GAINED:
            yield Finding("softening", test.source, {"share": shares[RELOADING]})


def on_misfit(fit: HyperelasticFit) -> Iterator[Finding]:
    """Yield what the material does not describe, and whether that or an unknown E makes it no success."""
    for test, misfit in zip(fit.tests, fit.misfits, strict=True):
        if misfit.warn or misfit.fail:
            values = {"test": test.mode, "share": misfit.share, "worst": misfit.worst}
            values |= {"from": misfit.start, "to": misfit.end}
            yield Finding("stress-not-described" if misfit.fail else "stress-misfit", values=values)
    if not fit.modulus_known:
        yield Finding(
            "modulus-unknown", values={"modulus": fit.material.youngs_modulus, "error": 3 * fit.modulus_error}
        )


def on_modes(fit: HyperelasticFit) -> Iterator[Finding]:
    """Yield what a fit predicts for loads that were not tested: the stress itself, so that everyone can judge it."""
    modes = [t.mode for t in fit.tests]
    farthest = fit.farthest
    wild = absurd_from(fit.material, fit.stretch_range[1]) if "equibiaxial" not in modes else None
    if len(modes) > 1 and wild is None:
        return
    shown = "uniaxial" if modes == ["equibiaxial"] else "equibiaxial"
    predicted, there = (float(fit.material.nominal(mode, farthest)) for mode in (shown, modes[0]))
    values: dict[str, Any] = {"test": modes[0], "shown": shown, "stretch": farthest}
    values |= {"predicted": predicted, "there": there}
    if wild is not None:
        values |= {"since": wild, "times": _ABSURD}
    alone = "one-load-tested" if wild is None else "one-load-tested-absurd"
    yield Finding(alone if len(modes) == 1 else "equibiaxial-absurd", values=values)
    if modes == ["planar"]:
        mirrored = Ogden(tuple(-m for m in fit.material.mu), tuple(-a for a in fit.material.alpha))
        stress = float(mirrored.nominal("equibiaxial", farthest))
        yield Finding("planar-sign", values={"stretch": farthest, "stress": stress})


def on_stability(fit: HyperelasticFit, instabilities: Sequence[Instability]) -> Iterator[Finding]:
    """Yield where the material is unstable."""
    codes = {"drucker": "drucker-fails", "slope": "stress-falls"}
    for found in instabilities:
        yield Finding(codes[found.kind], f"unstable in {found.mode} load", {"low": found.low, "high": found.high})
    if not fit.material.shear_modulus > 0:
        yield Finding("shear-modulus-negative", values={"modulus": fit.material.shear_modulus})


def on_modulus(fit: HyperelasticFit, small: tuple[float, float] | None) -> Iterator[Finding]:
    """Yield whether readings are near stretch 1, where E is the slope, and whether the fit follows them."""
    nearest = min(float(np.abs(t.stretch - 1).min()) for t in fit.tests)
    modulus = fit.material.youngs_modulus
    if nearest > 0.501 * SMALL:
        yield Finding("modulus-extrapolated", values={"distance": nearest})
    elif small is not None:
        # beyond the noise of both, and large enough to matter, even if the model misses the curve
        doubt = _E_ERRORS * float(np.hypot(small[1], 3 * np.nan_to_num(fit.plain_modulus_error)))
        if abs(modulus - small[0]) > max(doubt, _E_DIFFERS * small[0]):
            advice = "" if fit.weighting == "relative" else f"; {argument('weighting', 'relative')} follows them"
            values = {"fitted": modulus, "small": small[0], "error": small[1], "strain": SMALL, "advice": advice}
            yield Finding("modulus-differs", values=values)


def on_statistics(fit: HyperelasticFit) -> Iterator[Finding]:
    """Yield what is not determined, autocorrelated residuals, and a minimum that one start alone found."""
    for reason in fit.undetermined:
        yield Finding("material-not-determined", fit.name, {"reason": str(reason)})
    for test, residuals in zip(fit.tests, fit.residuals, strict=True):
        correlation = autocorrelation(residuals)
        rounding = np.abs(residuals).max() < ROUNDING * np.abs(test.stress).max()
        if correlation > max(0.3, 2.5 / np.sqrt(len(residuals))) and not rounding:
            yield Finding("stress-autocorrelated", values={"test": test.mode, "correlation": correlation})
    starts = fit.result.starts
    if not (starts.confirmed or fit.undetermined):
        yield Finding("start-not-confirmed", values={"starts": starts.starts})


def on_extrapolation(predictions: Sequence[Prediction]) -> Iterator[Finding]:
    """Yield which stretches no reading of a mode reaches."""
    for mode in MODES:
        beyond = [f"{p.stretch:.4g}" for p in predictions if p.mode == mode and not p.measured]
        if beyond:
            yield Finding("prediction-extrapolated", values={"test": mode, "stretches": beyond})
