"""Sections that the reports of all identifications share: parameters, correlations, residuals, the strip's circuit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..circuit.strip import strip_netlist
from ..fit.estimate import Method, Parameter
from ..fit.residuals import autocorrelations
from ..report.axes import BLUE, GREY, new_figure
from ..report.page import Grid, Listing, Picture, Prose, Section, picture
from ..strip.actuator import Actuator
from ..strip.file import dumps
from ..units import format_quantity
from .report import interval_text

Array = NDArray[np.float64]

#: What is said of intervals by each method.
_METHODS: dict[Method, str] = {
    "covariance": "Intervals without a mark are Student's, about the logarithms; residuals are taken as independent.",
    "bootstrap": "Those marked (bootstrap) take account of neighbouring residuals that are alike, by blocks of them.",
    "profile": "Those marked (profile) are where the profile likelihood leaves its 95 % level.",
    "mcmc": "Those marked (mcmc) are quantiles of the posterior, sampled by a Markov chain.",
}
#: In a report's table a correlation beyond this is pointed out.
_STRONG = 0.9


def parameter_section(parameters: Mapping[str, Parameter], title: str = "Parameters") -> Section:
    """Values with standard errors, 95 % intervals and units; for what was held, why."""
    methods = {p.method for p in parameters.values() if p.stderr is not None}
    grid = Grid(
        ("parameter", "value", "standard error", "95 % interval, or why it is held"),
        [_parameter(name, p) for name, p in parameters.items()],
        words=frozenset({0, 3}),
    )
    return Section(title, [grid, *(Prose(_METHODS[m]) for m in _METHODS if m in methods)])


def _parameter(name: str, p: Parameter) -> tuple[str, str, str, str]:
    value = format_quantity(p.value, p.unit, 5)
    if p.stderr is None or p.ci95 is None:
        return name, value, "held" if p.held else "undetermined", p.held
    told = format_quantity(p.honest[0], p.unit, 2) + (" (blocks)" if p.bootstrap is not None else "")
    interval = interval_text(p) + ("" if p.method == "covariance" else f" ({p.method})")
    return name, value, told, interval


def derived_section(derived: Mapping[str, Parameter]) -> Section:
    """Quantities that follow from the parameters or from the record."""
    rows = [(name, format_quantity(p.value, p.unit, 5)) for name, p in derived.items()]
    return Section("What follows from them", [Grid(("quantity", "value"), rows)])


def correlation_section(names: Sequence[str], correlations: Mapping[str, float]) -> Section:
    """The correlations as a full table, blank between parameters of different fits."""
    rows = []
    for a in names:
        cells = []
        for b in names:
            value = 1.0 if a == b else correlations.get(f"{a}, {b}", correlations.get(f"{b}, {a}"))
            cells.append("" if value is None else f"{value:+.2f}")
        rows.append((a, *cells))
    strong = [f"{pair.replace(', ', ' and ')} ({x:+.3f})" for pair, x in correlations.items() if abs(x) > _STRONG]
    note = f"Beyond {_STRONG}: {'; '.join(strong)}." if strong else f"None is beyond {_STRONG}."
    numbered = [f"{k}" for k in range(1, len(names) + 1)]
    titled = [(f"{k} {row[0]}", *row[1:]) for k, row in zip(numbered, rows, strict=True)]
    return Section("Correlations of the parameters", [Grid(("", *numbered), titled), Prose(note)])


def autocorrelation_picture(parts: Sequence[tuple[str, Array]]) -> Picture:
    """Bars over the lag for each (name, residuals), with the band that white noise would stay in."""
    figure, axes = new_figure(len(parts), [1.5] * len(parts))
    for panel, (name, residuals) in zip(axes, parts, strict=True):
        values = autocorrelations(residuals)
        white = 1.96 / np.sqrt(len(residuals))
        panel.axhspan(-white, white, color=GREY, alpha=0.25, lw=0)
        panel.vlines(np.arange(len(values)), 0.0, values, color=BLUE, linewidth=2.0)
        panel.axhline(0.0, color=GREY, linewidth=0.8)
        panel.set_ylabel("correlation")
        panel.set_title(name, fontsize=9, loc="left")
        panel.set_ylim(min(-0.3, float(values.min()) - 0.05), 1.05)
    axes[-1].set_xlabel("lag [samples]; grey: 95 % of white noise")
    return picture(figure, "autocorrelation of the residuals over the lag")


def circuit_sections(actuator: Actuator, statistics: Mapping[str, Any]) -> list[Section]:
    """Statistics, the fitted strip as a file, and its netlist."""
    netlist = str(strip_netlist(actuator, beam="static").to_pyspice())
    return [
        Section("Statistics", [Grid(("statistic", "value"), list(_flat(statistics)))]),
        Section("The fitted strip", [Listing(dumps(actuator))]),
        Section("Its circuit", [Listing(netlist)]),
    ]


def _flat(statistics: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    for name, value in statistics.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{name}: ")
        else:
            yield above + name, f"{value:.6g}" if isinstance(value, float) else str(value)
