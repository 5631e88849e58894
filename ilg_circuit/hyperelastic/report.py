"""A characterisation as text, JSON, a picture, and as the modulus of an actuator."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..errors import InputError
from ..fit.estimate import Parameter
from ..report.axes import BLUE, GREY, ORANGE, engineering, new_figure, save
from ..strip.actuator import Actuator
from ..strip.file import save_actuator
from ..units import format_quantity
from .analysis import Characterisation, Prediction, absurd_from, whole_range
from .fit import HyperelasticFit, describe
from .material import CONVENTION, MODES, OTHER_CONVENTION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = {"uniaxial": BLUE, "equibiaxial": ORANGE, "planar": "#2e8b57"}
_MARKERS = {"uniaxial": "o", "equibiaxial": "s", "planar": "^"}


def parameters(fit: HyperelasticFit) -> dict[str, Parameter]:
    """mu_i [Pa] and alpha_i in the paper's convention, with standard errors and 95 % intervals.

    Where mu_i alpha_i > 0 was imposed, mu_i's interval is that of its logarithm: it keeps the sign.
    """
    n, errors = fit.terms, np.sqrt(np.diag(fit.parameter_covariance()))
    result = {}
    for i, (mu, alpha) in enumerate(zip(fit.material.mu, fit.material.alpha, strict=True)):
        result[f"mu_{i + 1}"] = _estimate(fit, mu, float(errors[i]), "Pa", one_sign=fit.constrained)
        result[f"alpha_{i + 1}"] = (
            _estimate(fit, alpha, float(errors[n + i]), "")
            if fit.model == "ogden"
            else Parameter(alpha, "", held=f"{describe(fit.model, n)} by definition")
        )
    return result


def derived(fit: HyperelasticFit) -> dict[str, Parameter]:
    """G, E = 3 G, each mu_i in the other convention; for Mooney-Rivlin and neo-Hookean also C10 and C01."""
    g, error = fit.material.shear_modulus, fit.modulus_error
    result = {
        "shear_modulus": _estimate(fit, g, error, "Pa", one_sign=fit.constrained),
        "youngs_modulus": _estimate(fit, 3 * g, 3 * error, "Pa", one_sign=fit.constrained),
    }
    errors = np.sqrt(np.diag(fit.covariance))
    for i, modulus in enumerate(fit.material.moduli):
        name = f"mu_{i + 1}_other_convention"
        result[name] = _estimate(fit, modulus, float(errors[i]), "Pa", one_sign=fit.constrained)
        if fit.model != "ogden":
            c = ("c10", "c01")[i]
            result[c] = _estimate(fit, modulus / 2, float(errors[i]) / 2, "Pa", one_sign=fit.constrained)
    return result


def _estimate(fit: HyperelasticFit, value: float, error: float, unit: str, one_sign: bool = False) -> Parameter:
    """A value with its 95 % interval by Student's t, ``one_sign``: of its logarithm; bare where undetermined."""
    from scipy.stats import t as student

    if not math.isfinite(error):
        return Parameter(value, unit)
    half = float(student.ppf(0.975, fit.samples - fit.unknowns)) * error
    if one_sign:
        factor = math.exp(min(half / abs(value), 300.0))
        low, high = sorted((value / factor, value * factor))
    else:
        low, high = value - half, value + half
    return Parameter(value, unit, error, (low, high))


def correlations(fit: HyperelasticFit) -> dict[str, float]:
    """Of every pair of fitted parameters; empty where the data leave a combination open."""
    names = [f"mu_{i + 1}" for i in range(fit.terms)] + [f"alpha_{i + 1}" for i in range(fit.terms)]
    covariance = fit.parameter_covariance()[: fit.unknowns, : fit.unknowns]
    if np.isnan(covariance).any():
        return {}
    size = np.sqrt(np.diag(covariance))
    return {
        f"{names[b]}, {names[a]}": float(covariance[b, a] / (size[a] * size[b]))
        for a in range(fit.unknowns)
        for b in range(a)
    }


def to_json(result: Characterisation) -> dict[str, Any]:
    """The result as JSON-ready values in SI units."""
    fit, small = result.fit, result.small_strain_modulus
    return {
        "model": fit.model,
        "terms": fit.terms,
        "convention": CONVENTION,
        "other_convention": OTHER_CONVENTION,
        "parameters": {name: p.to_json() for name, p in parameters(fit).items()},
        "derived": {name: p.to_json() for name, p in derived(fit).items()},
        "statistics": _statistics(fit),
        "correlations": correlations(fit),
        "candidates": [
            {
                "model": f.model,
                "terms": f.terms,
                "rmse": f.rmse,
                "aic": f.aic,
                "bic": f.bic,
                "undetermined": list(f.undetermined),
            }
            for f in result.candidates
        ],
        "stability": {
            "constrained": fit.constrained,
            "mu_alpha_positive": fit.material.stable_by_sign,
            "unstable": [{"test": i.mode, "kind": i.kind, "stretch": [i.low, i.high]} for i in result.instabilities],
        },
        "small_strain_modulus": Parameter(small[0], "Pa", small[1]).to_json() if small else None,
        "predictions": [
            {
                "test": p.mode,
                "stretch": p.stretch,
                "nominal": p.nominal,
                "stderr": _finite(p.error),
                "cauchy": p.cauchy,
                "unit": "Pa",
                "measured": p.measured,
            }
            for p in result.predictions
        ],
        "warnings": list(result.warnings),
    }


def _statistics(fit: HyperelasticFit) -> dict[str, Any]:
    return {
        "rmse": fit.rmse,
        "rmse_unit": "Pa",
        "aic": fit.aic,
        "bic": fit.bic,
        "n": fit.samples,
        "weighting": fit.weighting,
        "starts": fit.starts,
        "starts_agreeing": fit.agreeing,
        "evaluations": fit.evaluations,
        "tests": {
            t.mode: {
                "source": t.source,
                "rmse": float(np.sqrt(np.mean(r**2))),
                "n": len(r),
                "stretch": [float(t.stretch[0]), float(t.stretch[-1])],
            }
            for t, r in zip(fit.tests, fit.residuals, strict=True)
        },
    }


def table(result: Characterisation) -> str:
    """The result for a terminal: parameters in both conventions, moduli, statistics, candidates, predictions."""
    fit = result.fit
    sources = ", ".join(f"{t.source} ({t.mode})" for t in fit.tests)
    how = "mu_i alpha_i > 0 imposed" if fit.constrained else "signs free"
    lines = [f"{sources}: {describe(fit.model, fit.terms)}, {how}, {fit.weighting} weighting"]
    lines += [f"convention: {CONVENTION}"]
    lines += ["", f"{'parameter':<24}{'value':>16}{'standard error':>18}   95 % interval"]
    lines += [_row(name, p) for name, p in parameters(fit).items()]
    more = derived(fit)
    lines += ["", *(_row(name, p) for name, p in more.items() if not name.endswith("other_convention"))]
    lines += ["", f"other convention: {OTHER_CONVENTION}"]
    lines += [
        _row(name.removesuffix("_other_convention"), p) for name, p in more.items() if name.endswith("other_convention")
    ]
    lines += ["", f"{'test':<24}{'rmse':>16}{'readings':>12}   stretch"]
    for mode, s in _statistics(fit)["tests"].items():
        low, high = s["stretch"]
        lines.append(f"{mode:<24}{_text(s['rmse'], 'Pa', 3):>16}{s['n']:>12}   {low:.4g} to {high:.4g}")
    lines.append(f"AIC {fit.aic:.1f}, BIC {fit.bic:.1f}; {fit.agreeing} of {fit.starts} starts ended here")
    strong = [f"{pair}: {value:+.3f}" for pair, value in correlations(fit).items() if abs(value) > 0.9]
    if strong:
        lines.append(f"correlations beyond 0.9: {'; '.join(strong)}")
    if len(result.candidates) > 1:
        lines += ["", f"{'model':<24}{'rmse':>16}{'BIC':>12}"]
        lines += [_candidate(f, fit) for f in result.candidates]
    lines += ["", f"{'predicted':<14}{'stretch':>10}{'nominal':>16}{'standard error':>18}{'Cauchy':>16}"]
    lines += [_prediction(p) for p in result.predictions]
    return "\n".join(lines)


def _row(name: str, p: Parameter) -> str:
    value = _text(p.value, p.unit)
    if p.held:
        return f"{name:<24}{value:>16}{'held':>18}   {p.held}"
    if p.stderr is None or p.ci95 is None:
        return f"{name:<24}{value:>16}{'undetermined':>18}"
    interval = f"{_text(p.ci95[0], p.unit)} to {_text(p.ci95[1], p.unit)}"
    return f"{name:<24}{value:>16}{_text(p.stderr, p.unit, 3):>18}   {interval}"


def _candidate(f: HyperelasticFit, chosen: HyperelasticFit) -> str:
    verdict = "chosen" if f is chosen else "; ".join(f.undetermined[:1])
    verdict += f", and {len(f.undetermined) - 1} more" if len(f.undetermined) > 1 and f is not chosen else ""
    row = f"{describe(f.model, f.terms):<24}{_text(f.rmse, 'Pa', 3):>16}{f.bic:>12.1f}   {verdict}"
    return row.rstrip()


def _prediction(p: Prediction) -> str:
    error = _text(p.error, "Pa", 3) if math.isfinite(p.error) else "undetermined"
    how = "" if p.measured else "   extrapolated"
    nominal, cauchy = _text(p.nominal, "Pa", 4), _text(p.cauchy, "Pa", 4)
    return f"{p.mode:<14}{p.stretch:>10.4g}{nominal:>16}{error:>18}{cauchy:>16}{how}"


def write_actuator(result: Characterisation, base: Actuator, path: str | Path) -> None:
    """Write ``base`` with the fitted E = 3 G as TOML; its comment says where E comes from. InputError if E <= 0."""
    fit = result.fit
    modulus = derived(fit)["youngs_modulus"]
    if not modulus.value > 0:
        raise InputError(
            f"the fitted Young's modulus is {_text(modulus.value, 'Pa')}, which no strip has; fit with mu_i alpha_i > 0"
        )
    error = f" +- {_text(modulus.stderr, 'Pa', 3)}" if modulus.stderr is not None else ""
    comment = "\n".join(
        [
            f"youngs_modulus = 3 G fitted by ilg_circuit {__version__}: {_text(modulus.value, 'Pa')}{error}",
            f"{describe(fit.model, fit.terms)}, {CONVENTION}",
            *(f"{name} = {_text(p.value, p.unit)}" for name, p in parameters(fit).items()),
            *(f"data: {t.source} ({t.mode})" for t in fit.tests),
            *(f"warning: {line}" for line in result.warnings),
        ]
    )
    material = replace(base.material, youngs_modulus=modulus.value)
    save_actuator(replace(base, material=material), path, comment)


def plot_characterisation(result: Characterisation, path: str | Path) -> None:
    """Write `characterisation_figure` as a picture."""
    save(characterisation_figure(result), path)


def characterisation_figure(result: Characterisation) -> Figure:
    """Readings, fit (solid where there are readings, dashed elsewhere), other loads dashed, residuals beneath."""
    fit = result.fit
    low, high = whole_range(fit.tests)
    stress = np.concatenate([t.stress for t in fit.tests])
    factor, unit = engineering(stress, "Pa")
    figure, (upper, lower) = new_figure(2, [3.4, 1.1])
    stretch = np.geomspace(low, high, 500)
    bottom, top = min(float(stress.min()), 0.0), max(float(stress.max()), 0.0)
    margin = 0.12 * (top - bottom)
    upper.set_ylim(factor * (bottom - (margin if bottom < 0 else 0.02 * top)), factor * (top + margin))
    tests = {t.mode: (t, r) for t, r in zip(fit.tests, fit.residuals, strict=True)}
    beyond = False
    for mode in MODES:
        curve, colour = fit.material.nominal(mode, stretch), _COLOURS[mode]
        if mode in tests:
            test, residuals = tests[mode]
            inside = (stretch >= test.range[0]) & (stretch <= test.range[1])
            upper.plot(test.stretch, factor * test.stress, _MARKERS[mode], color=colour, markersize=4, alpha=0.75,
                       markeredgewidth=0, label=f"{mode}, measured")  # fmt: skip
            upper.plot(stretch[inside], factor * curve[inside], color=colour, linewidth=1.5, label=f"{mode}, fit")
            for part in (stretch <= test.range[0], stretch >= test.range[1]):
                if part.sum() > 1:  # the end itself is always one
                    upper.plot(stretch[part], factor * curve[part], "--", color=colour, linewidth=1.0)
                    beyond = True
            lower.plot(
                test.stretch, factor * residuals, f"{_MARKERS[mode]}-", color=colour, markersize=3, linewidth=0.6
            )
        else:
            wild = absurd_from(fit.material, high) if mode == "equibiaxial" else None
            label = f"{mode}, predicted" + (f": absurd from {wild:.3g} on" if wild is not None else "")
            upper.plot(stretch, factor * curve, "--", color=colour, linewidth=1.2, label=label)
    upper.set_ylabel(f"nominal stress [{unit}]")
    if beyond:
        upper.plot([], [], "--", color=GREY, linewidth=1.0, label="beyond the readings")
    upper.legend(frameon=False, fontsize=8)
    upper.set_title(
        f"{describe(fit.model, fit.terms)}: E = {_text(fit.material.youngs_modulus, 'Pa', 4)}", fontsize=10, loc="left"
    )
    lower.axhline(0.0, color=GREY, linewidth=0.8)
    lower.set_ylabel(f"data - fit [{unit}]")
    lower.set_xlabel("stretch [1]")
    figure.align_ylabels([upper, lower])
    return figure


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _text(value: float, unit: str, digits: int = 5) -> str:
    return format_quantity(value, unit, digits)
