"""Presents the fit of a strip's shape: the resistance along it, and the marks with the fitted shape."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..identification.shape import ShapeFit
from ..units import format_quantity
from . import estimates
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, heading, legend_above, new_figure, plain, scaled


def headline(fit: ShapeFit) -> str:
    """Return one line: the strip, the number of marks, how it was driven."""
    how = "at rest" if fit.frequency is None else f"under a sine of {format_quantity(fit.frequency, 'Hz', 4)}"
    return f"shape of {fit.strip} {how}, {len(fit.places)} marks"


def facts(fit: ShapeFit) -> list[tuple[str, str]]:
    """Return the parameters with their errors, gamma L, and the size of the residuals."""
    return [
        *estimates.estimate_facts(fit.estimate_tables()["parameter"]),
        ("abs(gamma L)", f"{abs(fit.gamma_length):.4g}; its square is r y L^2, all that a shape tells"),
        ("rms of the residuals", format_quantity(_rms(fit), "m", 3)),
    ]


def summary(fit: ShapeFit) -> str:
    """Return parameters with errors and intervals, gamma L, and the size of the residuals."""
    lines = [headline(fit), "", estimates.HEADER]
    lines += [estimates.estimate_line(name, e) for name, e in fit.estimate_tables()["parameter"].items()]
    lines += ["", *(f"{name} {value}" for name, value in facts(fit)[-2:])]
    return "\n".join(lines)


def figure(fit: ShapeFit) -> Figure:
    """Return the marks with the fitted shape, and the residuals."""
    figure, (upper, lower) = new_figure(2, [2.4, 1.0])
    _marks(fit, upper)
    upper.set_xlabel("")
    _residuals(fit, lower)
    figure.align_ylabels([upper, lower])
    heading(figure, headline(fit))
    return figure


def panels(fit: ShapeFit) -> Panels:
    """Return the panels: the marks with the fit, the residuals."""
    return {"marks": partial(_marks, fit), "residuals": partial(_residuals, fit)}


def _rms(fit: ShapeFit) -> float:
    away = fit.measured - fit.fitted
    return float(np.sqrt((np.abs(away) ** 2).mean() / 2))


def _parts(fit: ShapeFit) -> dict[str, tuple[Any, Any, str]]:
    """Return what is drawn: label -> measured, fitted, colour."""
    if fit.frequency is None:
        return {"y": (fit.measured.imag, fit.fitted.imag, BLUE)}
    return {
        "in phase": (fit.measured.real, fit.fitted.real, BLUE),
        "a quarter later": (-fit.measured.imag, -fit.fitted.imag, ORANGE),
    }


def _marks(fit: ShapeFit, panel: Axes, **style: Any) -> Axes:
    """Draw y, or its amplitude, of the marks and of the fit over the distance from the clamp."""
    across, unit_across = scaled(panel.xaxis, fit.places, "m")
    factor, unit = scaled(panel.yaxis, np.concatenate([part[0] for part in _parts(fit).values()]), "m")
    order = np.argsort(fit.places)
    for label, (measured, fitted, colour) in _parts(fit).items():
        look: dict[str, Any] = {"color": colour, "linewidth": 1.4, "label": f"{label}, fit"} | style
        panel.plot(across * fit.places[order], factor * fitted[order], **look)
        panel.plot(across * fit.places, factor * measured, "o", color=colour, markersize=4, label=label)
    panel.set(xlabel=f"from the clamp [{unit_across}]", ylabel=f"y [{unit}]")
    plain(panel)
    legend_above(panel)
    return panel


def _residuals(fit: ShapeFit, panel: Axes, **style: Any) -> Axes:
    """Draw what the fit leaves of the marks."""
    across, unit_across = scaled(panel.xaxis, fit.places, "m")
    away = [measured - fitted for measured, fitted, _ in _parts(fit).values()]
    factor, unit = scaled(panel.yaxis, np.concatenate(away), "m")
    for left, (_, _, colour) in zip(away, _parts(fit).values(), strict=True):
        look: dict[str, Any] = {"color": colour, "marker": "o", "markersize": 4, "linestyle": "none"} | style
        panel.plot(across * fit.places, factor * left, **look)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.set(xlabel=f"from the clamp [{unit_across}]", ylabel=f"residuals [{unit}]")
    plain(panel)
    return panel
