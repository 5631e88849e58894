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

#: Number of points at which a range of stretches is checked for instability and implausible stresses.
POINTS = 400

#: Ratio of equibiaxial to uniaxial stress above which it is implausible; rubbers and gels have 1 to 3, initially 2.
_ABSURD = 10.0
#: Largest relative difference of the fitted E and the E from small strains alone, and least difference in combined
#: standard errors for it to be significant.
_E_DIFFERS, _E_ERRORS = 0.1, 2.5
#: Least relative difference of work between branches that is significant.
_GAINED = 0.02


def absurd_from(material: Ogden, high: float) -> float | None:
    """Return the stretch up to ``high`` from which the equibiaxial stress is over ten times the uniaxial; else None.

    Only tension is checked: in compression a sheet pressed in its plane carries far more than a column.
    """
    stretch = np.geomspace(1.0, high, POINTS)[1:] if high > 1 else np.empty(0)
    ratio = material.nominal("equibiaxial", stretch) / material.nominal("uniaxial", stretch)
    wild = np.flatnonzero(~(np.abs(ratio) <= _ABSURD))
    return float(stretch[wild[0]]) if len(wild) else None


def on_branches(tests: Sequence[LoadTest]) -> Iterator[Finding]:
    """Yield findings on the branches of a test: which were fitted, and their hysteresis."""
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
    """Yield findings on a misfit and on an undetermined E, with whether they make the fit fail."""
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
    """Yield findings with the predicted stress for loads that were not tested, for the reader to judge."""
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
    """Yield findings on the ranges where the material is unstable."""
    codes = {"drucker": "drucker-fails", "slope": "stress-falls"}
    for found in instabilities:
        yield Finding(codes[found.kind], f"unstable in {found.mode} load", {"low": found.low, "high": found.high})
    if not fit.material.shear_modulus > 0:
        yield Finding("shear-modulus-negative", values={"modulus": fit.material.shear_modulus})


def on_modulus(fit: HyperelasticFit, small: tuple[float, float] | None) -> Iterator[Finding]:
    """Yield findings on E, the slope at stretch 1: extrapolated, or different from the readings near 1."""
    nearest = min(float(np.abs(t.stretch - 1).min()) for t in fit.tests)
    modulus = fit.material.youngs_modulus
    if nearest > 0.501 * SMALL:
        yield Finding("modulus-extrapolated", values={"distance": nearest})
    elif small is not None:
        # significant compared with both errors, and large enough to matter, even if the model has a misfit
        doubt = _E_ERRORS * float(np.hypot(small[1], 3 * np.nan_to_num(fit.plain_modulus_error)))
        if abs(modulus - small[0]) > max(doubt, _E_DIFFERS * small[0]):
            advice = "" if fit.weighting == "relative" else f"; {argument('weighting', 'relative')} follows them"
            values = {"fitted": modulus, "small": small[0], "error": small[1], "strain": SMALL, "advice": advice}
            yield Finding("modulus-differs", values=values)


def on_statistics(fit: HyperelasticFit) -> Iterator[Finding]:
    """Yield findings on undetermined parameters, autocorrelated residuals, and an unconfirmed minimum."""
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
    """Yield findings on stretches beyond the readings of a mode."""
    for mode in MODES:
        beyond = [f"{p.stretch:.4g}" for p in predictions if p.mode == mode and not p.measured]
        if beyond:
            yield Finding("prediction-extrapolated", values={"test": mode, "stretches": beyond})
