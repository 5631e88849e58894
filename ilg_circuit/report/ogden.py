"""Presents hyperelastic characterisations, and writes the modulus into a strip."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..errors import InputError
from ..findings import sentences
from ..hyperelastic.characterisation import Characterisation
from ..hyperelastic.diagnostics import absurd_from
from ..hyperelastic.estimates import correlations, derived, parameters
from ..hyperelastic.material import CONVENTION, MODES, OTHER_CONVENTION
from ..strip.actuator import Actuator
from ..strip.file import save_actuator
from ..units import format_quantity
from . import estimates
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, caption, engineering, new_figure, scaled
from .page import Grid, Page, Prose, Section, picture, repetition

_STYLES = {"uniaxial": (BLUE, "o"), "equibiaxial": (ORANGE, "s"), "planar": ("#2e8b57", "^")}


def summary(result: Characterisation) -> str:
    """Return the result for a terminal: parameters in both conventions, statistics, candidates, predictions."""
    fit, more = result.fit, derived(result.fit)
    other = {name: e for name, e in more.items() if name.endswith("_other_convention")}
    lines = [headline(result), f"convention: {CONVENTION}", "", estimates.HEADER]
    lines += [estimates.estimate_line(name, e) for name, e in parameters(fit).items()]
    lines += estimates.method_lines(parameters(fit))
    lines += ["", *(estimates.estimate_line(name, e) for name, e in more.items() if name not in other)]
    lines += ["", f"other convention: {OTHER_CONVENTION}"]
    lines += [estimates.estimate_line(name.removesuffix("_other_convention"), e) for name, e in other.items()]
    lines += ["", *_tests(result).lines("<<>><")]
    starts = fit.result.starts
    lines.append(f"AIC {fit.aic:.1f}, BIC {fit.bic:.1f}; {starts.agreeing} of {starts.starts} starts ended here")
    strong = [f"{pair}: {value:+.3f}" for pair, value in estimates.strong_correlations(correlations(fit)).items()]
    lines += [f"correlations beyond 0.9: {'; '.join(strong)}"] if strong else []
    if len(result.candidates) > 1:
        lines += ["", *_candidates(result).lines("<>><")]
    return "\n".join([*lines, "", *_predictions(result).lines("<>>>><")])


def headline(result: Characterisation) -> str:
    """Return one line: the tests, the model, the constraint on signs and the weighting."""
    fit = result.fit
    sources = ", ".join(f"{t.source} ({t.mode})" for t in fit.tests)
    return (
        f"{sources}: {fit.name}, {'mu_i alpha_i > 0 imposed' if fit.constrained else 'signs free'}, "
        f"{fit.weighting} weighting"
    )


def page(result: Characterisation) -> Page:
    """Return a page: readings and fit, constants in both conventions, predictions for other loads, other candidates."""
    fit, fitted = result.fit, parameters(result.fit)
    told = [
        ("material", fit.name),
        ("Young's modulus", _stress(fit.material.youngs_modulus)),
        ("rms of the residuals", _stress(fit.rmse, 3)),
    ]
    note = f"{CONVENTION}. The constants ..._other_convention are those of {OTHER_CONVENTION}."
    drawn = picture(figure(result), "nominal stress over stretch: readings, fit, predictions, residuals")
    sections = [
        Section("Readings, fit and residuals", [drawn, _tests(result)]),
        Section("Candidates", [_candidates(result)]),
        estimates.parameter_section(fitted),
        Section("Convention", [Prose(note)]),
        estimates.derived_section(derived(fit)),
        Section("Predictions", [_predictions(result)]),
        estimates.correlation_section([name for name, e in fitted.items() if not e.fixed_because], correlations(fit)),
        repetition(result.provenance.call),
    ]
    return Page(", ".join(t.source for t in fit.tests), headline(result), told, result.warnings, sections)


def figure(result: Characterisation) -> Figure:
    """Return a figure: readings, fit (dashed beyond the readings), predictions for other loads (dashed), residuals."""
    figure, (upper, lower) = new_figure(2, [3.4, 1.1])
    _stresses(result, upper)
    upper.set_xlabel("")
    _residuals(result, lower)
    figure.align_ylabels([upper, lower])
    return figure


def panels(result: Characterisation) -> Panels:
    """Return the panels: stresses with the fit, and residuals."""
    return {"stress": partial(_stresses, result), "residuals": partial(_residuals, result)}


def facts(result: Characterisation) -> list[tuple[str, str]]:
    """Return E and the parameters, each with its standard error, and the rms of the residuals."""
    fit = result.fit
    modulus = {"youngs_modulus": derived(fit)["youngs_modulus"]}
    told = estimates.estimate_facts(modulus | parameters(fit))
    return [told[0], ("rms of the residuals", _stress(fit.rmse, 3)), *told[1:]]


def _stresses(result: Characterisation, panel: Axes, **style: Any) -> Axes:
    """Draw readings, the fit and the predictions of other loads."""
    fit = result.fit
    low, high = fit.stretch_range
    stress = np.concatenate([t.stress for t in fit.tests])
    factor, unit = scaled(panel.yaxis, stress, "Pa")
    stretch = np.geomspace(low, high, 500)
    bottom, top = min(float(stress.min()), 0.0), max(float(stress.max()), 0.0)
    margin = 0.12 * (top - bottom)
    panel.set_ylim(factor * (bottom - (margin if bottom < 0 else 0.02 * top)), factor * (top + margin))
    tests = {t.mode: t for t in fit.tests}
    beyond = False
    for mode in MODES:
        curve, (colour, marker) = factor * fit.material.nominal(mode, stretch), _STYLES[mode]
        if mode not in tests:
            wild = absurd_from(fit.material, high) if mode == "equibiaxial" else None
            label = f"{mode}, predicted" + (f": absurd from {wild:.3g} on" if wild is not None else "")
            panel.plot(stretch, curve, "--", color=colour, linewidth=1.2, label=label)
            continue
        test = tests[mode]
        start, end = test.range
        inside = (stretch >= start) & (stretch <= end)
        measured: dict[str, Any] = {"markersize": 4, "alpha": 0.75, "markeredgewidth": 0, "label": f"{mode}, measured"}
        if len(test.left_out):
            stretches, stresses = np.concatenate([(leg.stretch, leg.stress) for leg in test.left_out], axis=1)
            faint: dict[str, Any] = {"color": GREY, "markersize": 2.5, "alpha": 0.5, "label": f"{mode}, not fitted"}
            panel.plot(stretches, factor * stresses, marker, **faint)
        panel.plot(test.stretch, factor * test.stress, marker, color=colour, **measured)
        look: dict[str, Any] = {"color": colour, "linewidth": 1.5, "label": f"{mode}, fit"} | style
        panel.plot(stretch[inside], curve[inside], **look)
        for part in (stretch <= start, stretch >= end):
            if part.sum() > 1:  # the end itself is always one
                panel.plot(stretch[part], curve[part], "--", color=look["color"], linewidth=1.0)
                beyond = True
    panel.set(xlabel="stretch [1]", ylabel=f"nominal stress [{unit}]")
    if beyond:
        panel.plot([], [], "--", color=GREY, linewidth=1.0, label="beyond the readings")
    panel.legend(frameon=False, fontsize="small")
    caption(panel, f"{fit.name}: E = {_stress(fit.material.youngs_modulus)}")
    return panel


def _residuals(result: Characterisation, panel: Axes, **style: Any) -> Axes:
    """Draw data - fit of every test, in the unit of the stresses."""
    fit = result.fit
    factor, unit = engineering(np.concatenate([t.stress for t in fit.tests]), "Pa")
    for t, residuals in zip(fit.tests, fit.residuals, strict=True):
        colour, marker = _STYLES[t.mode]
        look: dict[str, Any] = {"color": colour, "marker": marker, "markersize": 3, "linewidth": 0.6} | style
        panel.plot(t.stretch, factor * residuals, **look)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.set(xlabel="stretch [1]", ylabel=f"data - fit [{unit}]")
    return panel


def write_actuator(result: Characterisation, base: Actuator, path: str | Path) -> None:
    """Write ``base`` with the fitted E = 3 G as TOML; its comment says where E comes from. InputError if E <= 0."""
    fit, modulus = result.fit, derived(result.fit)["youngs_modulus"]
    value = format_quantity(modulus.value, "Pa", 5)
    if not modulus.value > 0:
        raise InputError(f"the fitted Young's modulus is {value}, which no strip has; fit with mu_i alpha_i > 0")
    error = estimates.plus_minus(modulus) if modulus.stderr is not None else ""
    comment = [
        f"youngs_modulus = 3 G fitted by ilg_circuit {__version__}: {value}{error}",
        f"{fit.name}, {CONVENTION}",
        *(f"{name} = {format_quantity(e.value, e.unit, 5)}" for name, e in parameters(fit).items()),
        *(f"data: {t.source} ({t.mode})" for t in fit.tests),
        *(f"warning: {line}" for line in result.warnings),
        *result.provenance.lines()[1:],
    ]
    material = replace(base.material, youngs_modulus=modulus.value)
    save_actuator(replace(base, material=material), path, "\n".join(comment))


def _tests(result: Characterisation) -> Grid:
    fit = result.fit
    rows = [
        (
            t.mode,
            t.source,
            _stress(fit.result.rms_of(k), 3),
            f"{len(t.stretch)}",
            "{:.4g} to {:.4g}".format(*t.extent),
        )
        for k, t in enumerate(fit.tests)
    ]
    return Grid(("test", "file", "rms", "readings", "stretch"), rows, words=frozenset({0, 1}))


def _candidates(result: Characterisation) -> Grid:
    fit = result.fit
    rows = [
        (f.name, _stress(f.rmse, 3), f"{f.bic:.1f}", "chosen" if f is fit else "; ".join(sentences(f.undetermined)))
        for f in result.candidates
    ]
    chosen = frozenset(k for k, f in enumerate(result.candidates) if f is fit)
    return Grid(("model", "rms", "BIC", "verdict"), rows, words=frozenset({0, 3}), marked=chosen)


def _predictions(result: Characterisation) -> Grid:
    rows = [
        (
            p.mode,
            f"{p.stretch:.4g}",
            _stress(p.nominal),
            _stress(p.error, 3) if math.isfinite(p.error) else "undetermined",
            _stress(p.cauchy),
            "measured" if p.measured else "extrapolated",
        )
        for p in result.predictions
    ]
    header = ("load", "stretch", "nominal stress", "standard error", "Cauchy stress", "range")
    return Grid(header, rows, words=frozenset({0, 5}))


def _stress(value: float, digits: int = 4) -> str:
    return format_quantity(value, "Pa", digits)
