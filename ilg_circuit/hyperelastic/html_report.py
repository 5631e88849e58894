"""A characterisation as an HTML report."""

from __future__ import annotations

from pathlib import Path

from ..identify.html_parts import correlation_section, derived_section, parameter_section
from ..report.page import Grid, Page, Picture, Prose, Section, picture, repetition, write_page
from ..units import format_quantity
from .analysis import Characterisation
from .fit import HyperelasticFit, describe
from .material import CONVENTION, OTHER_CONVENTION
from .report import characterisation_figure, correlations, derived, parameters


def write_report(result: Characterisation, path: str | Path, command: str) -> None:
    """Write the report, whole or not at all. ``command`` is the line that makes it again."""
    write_page(page_of(result, command), path)


def page_of(result: Characterisation, command: str) -> Page:
    """Readings and fit, constants in both conventions, predictions for other loads, what else was tried."""
    fit = result.fit
    estimates = parameters(fit)
    sources = ", ".join(f"{t.source} ({t.mode})" for t in fit.tests)
    facts = [
        ("material", describe(fit.model, fit.terms)),
        ("Young's modulus", format_quantity(fit.material.youngs_modulus, "Pa", 4)),
        ("rms of the residuals", format_quantity(fit.rmse, "Pa", 3)),
    ]
    how = "mu_i alpha_i > 0 imposed" if fit.constrained else "signs free"
    free = [name for name, p in estimates.items() if not p.held]
    sections = [
        Section("Readings, fit and residuals", [_picture(result), _tests(fit)]),
        Section("Candidates", [_candidates(result)]),
        parameter_section(estimates),
        Section(
            "Convention", [Prose(f"{CONVENTION}. The constants ..._other_convention are those of {OTHER_CONVENTION}.")]
        ),
        derived_section(derived(fit)),
        Section("Predictions", [_predictions(result)]),
        correlation_section(free, correlations(fit)),
        repetition(command),
    ]
    headline = f"{sources}: {describe(fit.model, fit.terms)}, {how}, {fit.weighting} weighting"
    return Page(", ".join(t.source for t in fit.tests), headline, facts, result.warnings, sections)


def _picture(result: Characterisation) -> Picture:
    return picture(
        characterisation_figure(result), "nominal stress over stretch: readings, fit, predictions, residuals"
    )


def _tests(fit: HyperelasticFit) -> Grid:
    rows = [
        (
            t.mode,
            t.source,
            format_quantity(float((r @ r / len(r)) ** 0.5), "Pa", 3),
            f"{len(r)}",
            f"{t.stretch[0]:.4g} to {t.stretch[-1]:.4g}",
        )
        for t, r in zip(fit.tests, fit.residuals, strict=True)
    ]
    return Grid(("test", "file", "rms", "readings", "stretch"), rows, words=frozenset({0, 1}))


def _predictions(result: Characterisation) -> Grid:
    rows = [
        (
            p.mode,
            f"{p.stretch:.4g}",
            format_quantity(p.nominal, "Pa", 4),
            format_quantity(p.error, "Pa", 3),
            format_quantity(p.cauchy, "Pa", 4),
            "measured" if p.measured else "extrapolated",
        )
        for p in result.predictions
    ]
    header = ("load", "stretch", "nominal stress", "standard error", "Cauchy stress", "range")
    return Grid(header, rows, words=frozenset({0, 5}))


def _candidates(result: Characterisation) -> Grid:
    rows = [
        (
            describe(f.model, f.terms),
            format_quantity(f.rmse, "Pa", 3),
            f"{f.bic:.1f}",
            "chosen" if f is result.fit else "; ".join(f.undetermined),
        )
        for f in result.candidates
    ]
    chosen = frozenset(k for k, f in enumerate(result.candidates) if f is result.fit)
    return Grid(("model", "rms", "BIC", "verdict"), rows, words=frozenset({0, 3}), marked=chosen)
