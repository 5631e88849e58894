"""Presents the fit of a curve: its parameters, data and residuals."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..fit.result import FitResult
from . import estimates
from .axes import BLUE, GREY, Axes, Figure, Panels, axis_label, new_figure


def headline(fit: FitResult) -> str:
    """Return one line: the numbers of parameters and of data, and the sources."""
    sources = ", ".join(dict.fromkeys(o.source for o in fit.problem.observations))
    return f"{len(fit.values)} parameters fitted to {len(fit.residuals)} numbers of {sources}"


def facts(fit: FitResult) -> list[tuple[str, str]]:
    """Return the parameters, each with its standard error, and the size of the residuals."""
    return [*estimates.estimate_facts(fit.estimates), ("rms of the residuals", f"{fit.rmse:.4g}")]


def summary(fit: FitResult) -> str:
    """Return parameters with errors and intervals, and the statistics."""
    lines = [headline(fit), "", estimates.HEADER, *(estimates.estimate_line(n, e) for n, e in fit.estimates.items())]
    starts = f"{fit.starts.agreeing} of {fit.starts.starts} starts ended here"
    strong = estimates.strong_correlations(fit.to_dict()["correlations"])
    lines += ["", f"rms of the residuals {fit.rmse:.4g}, AIC {fit.aic:.1f}, BIC {fit.bic:.1f}; {starts}"]
    return "\n".join([*lines, *(f"correlation {pair}: {value:+.3f}" for pair, value in strong.items())])


def figure(fit: FitResult) -> Figure:
    """Return a figure with data, fit and residuals of each observation."""
    count = len(fit.problem.observations)
    figure, axes = new_figure(2 * count, [2.4, 1.0] * count)
    for k, (upper, lower) in enumerate(zip(axes[::2], axes[1::2], strict=True)):
        _data(fit, k, upper)
        upper.set_xlabel("")
        _residuals(fit, k, lower)
    figure.align_ylabels(axes)
    return figure


def panels(fit: FitResult) -> Panels:
    """Return the panels: data with fit, and residuals, of each observation."""
    count = len(fit.problem.observations)
    ends = {k: "" if count == 1 else f" {k + 1}" for k in range(count)}
    data = {f"data{end}": partial(_data, fit, k) for k, end in ends.items()}
    return {**data, **{f"residuals{end}": partial(_residuals, fit, k) for k, end in ends.items()}}


def _data(fit: FitResult, k: int, panel: Axes, **style: Any) -> Axes:
    """Draw data and fit; real and imaginary part of complex data."""
    curve = list(fit.curves())[k]
    x = np.asarray(curve.x.values)
    order = np.argsort(x, kind="stable")
    parts = ("real", "imag") if np.iscomplexobj(curve.measured) else ("real",)
    for part in parts:
        end = f", {part}" if len(parts) > 1 else ""
        look: dict[str, Any] = {"color": BLUE, "linewidth": 1.5, "label": f"fit{end}"} | style
        panel.plot(x, getattr(curve.measured, part), ".", color=GREY, markersize=4, label=f"data{end}")
        panel.plot(x[order], getattr(curve.fitted, part)[order], **look)
    panel.set(xlabel="x", ylabel=axis_label(curve.quantity, curve.unit))
    panel.legend(frameon=False, fontsize="small")
    return panel


def _residuals(fit: FitResult, k: int, panel: Axes, **style: Any) -> Axes:
    """Draw the residuals (data - fit); real and imaginary part of complex data."""
    curve = list(fit.curves())[k]
    look: dict[str, Any] = {"color": GREY, "markersize": 3, "linestyle": "", "marker": "."} | style
    left = curve.measured - curve.fitted
    for part in ("real", "imag") if np.iscomplexobj(left) else ("real",):
        panel.plot(np.asarray(curve.x.values), getattr(left, part), **look)
    panel.axhline(0.0, color=BLUE, linewidth=0.8)
    panel.set(xlabel="x", ylabel="data - fit")
    return panel
