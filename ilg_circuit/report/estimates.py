"""Estimates as text and as sections of a page: parameters, derived quantities, correlations, residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isinf

import numpy as np

from ..arrays import Array
from ..fit.criteria import autocorrelations
from ..fit.estimate import Estimate, Method
from ..units import format_quantity
from .axes import BLUE, GREY, caption, new_figure
from .page import Grid, Picture, Prose, Section, picture

#: Method -> note on its intervals: in a terminal, and on a page.
_METHODS: dict[Method, tuple[str, str]] = {
    "covariance": (
        "intervals from the covariance",
        "Intervals without a mark are Student's, about the logarithms; residuals are taken as independent.",
    ),
    "bootstrap": (
        "standard errors and intervals from a block bootstrap",
        "Those marked (bootstrap) allow for autocorrelated residuals, by a block bootstrap.",
    ),
    "autoregression": (
        "standard errors and intervals from an autoregression of the residuals, no narrower than a block bootstrap's",
        "Those marked (autoregression) allow for autocorrelated residuals, taken for an AR(1); none is narrower than a "
        "block bootstrap's.",
    ),
    "profile": (
        "intervals from the profile likelihood",
        "Those marked (profile) are where the profile likelihood leaves its 95 % level.",
    ),
    "mcmc": (
        "intervals from the posterior, by Markov chain",
        "Those marked (mcmc) are quantiles of the posterior, sampled by a Markov chain.",
    ),
}
#: Correlations larger than this are reported.
_STRONG = 0.9
HEADER = f"{'parameter':<28}{'value':>16}{'standard error':>18}   95 % interval"


def estimate_line(name: str, e: Estimate) -> str:
    """Return a line of the terminal's table: value, standard error, interval or the reason why not fitted."""
    value = format_quantity(e.value, e.unit, 5)
    if e.stderr is None or e.ci95 is None:
        return f"{name:<28}{value:>16}{_not_fitted(e):>18}   {e.fixed_because}".rstrip()
    return f"{name:<28}{value:>16}{format_quantity(e.reported[0], e.unit, 2):>18}   {interval_text(e)}"


def _not_fitted(e: Estimate) -> str:
    return "held" if e.fixed_because else "undetermined"


def derived_line(name: str, e: Estimate) -> str:
    """Return a line of the table of derived quantities, with the reason why a quantity was not fitted."""
    error = f"{format_quantity(e.stderr, e.unit, 2):>18}" if e.stderr is not None else ""
    error += f"   {interval_text(e)}" if e.stderr is not None and e.ci95 is not None else ""
    held = f"{_not_fitted(e):>18}   {e.fixed_because}" if e.fixed_because else ""
    return f"{name:<28}{format_quantity(e.value, e.unit, 5):>16}{error}{held}"


def interval_text(e: Estimate) -> str:
    """Return the reported interval as text; an unbounded side in words."""
    low, high = e.reported[1]
    if low == 0 and isinf(high):
        return "no limits"
    if isinf(high):
        return f"{format_quantity(low, e.unit, 5)} or more"
    upper = format_quantity(high, e.unit, 5)
    return f"{format_quantity(low, e.unit, 5)} to {upper}" if low else f"{upper} or less"


def plus_minus(e: Estimate) -> str:
    """Return the standard error as text that follows a value in a comment."""
    return f" +- {format_quantity(e.reported[0], e.unit, 2)}" if e.stderr is not None else " (held)"


def estimate_facts(estimates: Mapping[str, Estimate]) -> list[tuple[str, str]]:
    """Return name, and value with standard error as text."""
    return [(name, f"{format_quantity(e.value, e.unit, 5)}{plus_minus(e)}") for name, e in estimates.items()]


def method_lines(estimates: Mapping[str, Estimate]) -> list[str]:
    """Return one line per method of intervals other than the covariance."""
    groups: dict[Method, list[str]] = {}
    fitted = {name: e for name, e in estimates.items() if e.stderr is not None}
    for name, e in fitted.items():
        groups.setdefault(e.method, []).append(name)
    groups.pop("covariance", None)
    return [
        f"({_METHODS[method][0]}{'' if len(names) == len(fitted) else ': ' + ', '.join(names)})"
        for method, names in groups.items()
    ]


def strong_correlations(correlations: Mapping[str, float]) -> dict[str, float]:
    """Return the correlations that are reported."""
    return {pair: value for pair, value in correlations.items() if abs(value) > _STRONG}


def parameter_section(estimates: Mapping[str, Estimate], title: str = "Parameters") -> Section:
    """Return a table of values, standard errors and 95 % intervals; for held parameters the reason."""
    methods = {e.method for e in estimates.values() if e.stderr is not None}
    rows = [_cells(name, e) for name, e in estimates.items()]
    header = ("parameter", "value", "standard error", "95 % interval, or why it is held")
    grid = Grid(header, rows, words=frozenset({0, 3}))
    return Section(title, [grid, *(Prose(_METHODS[m][1]) for m in _METHODS if m in methods)])


def _cells(name: str, e: Estimate) -> tuple[str, str, str, str]:
    value = format_quantity(e.value, e.unit, 5)
    if e.stderr is None or e.ci95 is None:
        return name, value, _not_fitted(e), e.fixed_because
    size = e.reported[0]
    marks = ((e.autoregression, " (autoregression)"), (e.bootstrap, " (blocks)"), (size, ""))
    error = format_quantity(size, e.unit, 2) + next(mark for known, mark in marks if known == size)
    return name, value, error, interval_text(e) + ("" if e.method == "covariance" else f" ({e.method})")


def derived_section(derived: Mapping[str, Estimate]) -> Section:
    """Return quantities that follow from the parameters or from the record, with errors and intervals where known."""
    rows = [_derived_cells(name, e) for name, e in derived.items()]
    header = ("quantity", "value", "standard error", "95 % interval, or why it was not fitted")
    if not any(error or told for _, _, error, told in rows):
        return Section("What follows from them", [Grid(header[:2], [row[:2] for row in rows])])
    return Section("What follows from them", [Grid(header, rows, words=frozenset({0, 3}))])


def _derived_cells(name: str, e: Estimate) -> tuple[str, str, str, str]:
    if e.stderr is not None and e.ci95 is not None:
        return _cells(name, e)
    return name, format_quantity(e.value, e.unit, 5), "", e.fixed_because


def correlation_section(names: Sequence[str], correlations: Mapping[str, float]) -> Section:
    """Return the correlations as a full table, blank between parameters of different fits."""
    rows = []
    for k, a in enumerate(names, 1):
        cells = []
        for b in names:
            value = 1.0 if a == b else correlations.get(f"{a}, {b}", correlations.get(f"{b}, {a}"))
            cells.append("" if value is None else f"{value:+.2f}")
        rows.append((f"{k} {a}", *cells))
    strong = [f"{pair.replace(', ', ' and ')} ({x:+.3f})" for pair, x in strong_correlations(correlations).items()]
    note = f"Beyond {_STRONG}: {'; '.join(strong)}." if strong else f"None is beyond {_STRONG}."
    header = ("", *(f"{k}" for k in range(1, len(names) + 1)))
    return Section("Correlations of the parameters", [Grid(header, rows), Prose(note)])


def autocorrelation_picture(parts: Sequence[tuple[str, Array]]) -> Picture:
    """Return autocorrelations over the lag of each (name, residuals), with the 95 % band of white noise."""
    figure, axes = new_figure(len(parts), [1.5] * len(parts))
    for panel, (name, residuals) in zip(axes, parts, strict=True):
        values = autocorrelations(residuals)
        white = 1.96 / np.sqrt(len(residuals))
        panel.axhspan(-white, white, color=GREY, alpha=0.25, lw=0)
        panel.vlines(np.arange(len(values)), 0.0, values, color=BLUE, linewidth=2.0)
        panel.axhline(0.0, color=GREY, linewidth=0.8)
        panel.set_ylabel("correlation")
        caption(panel, name)
        panel.set_ylim(min(-0.3, float(values.min()) - 0.05), 1.05)
    axes[-1].set_xlabel("lag [samples]; grey: 95 % of white noise")
    return picture(figure, "autocorrelation of the residuals over the lag")
