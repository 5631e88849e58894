"""An identification as one HTML file that needs nothing else: it opens offline, and can be sent to a colleague."""

from __future__ import annotations

import base64
import io
import json
import platform
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..actuator_file import dumps
from ..circuit.strip import strip_netlist
from ..files import write_text
from ..plots import BLUE, GREY, new_figure
from ..units import format_quantity
from .identification import Identification, Parameter
from .report import headline, identification_figure
from .residuals import autocorrelations

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_PACKAGES = ("ilg-circuit", "PySpice", "numpy", "scipy", "lmfit")


def write_report(result: Identification, path: str | Path, command: str = "") -> None:
    """Write the report, whole or not at all. ``command`` is the line that makes it again."""
    write_text(Path(path), html(result, command))


def html(result: Identification, command: str = "") -> str:
    """The report's text: pictures are in it, nothing is loaded from elsewhere."""
    from jinja2 import Environment

    template = (files(__package__) / "report.html.j2").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, trim_blocks=False, keep_trailing_newline=True)
    return environment.from_string(template).render(_content(result, command))


def _content(result: Identification, command: str) -> dict[str, Any]:
    peak = float(np.abs(result.current.data).max())
    best = min((c.bic for c in result.candidates if c.bic is not None), default=0.0)
    fits = [result.current.fit] + ([result.displacement.fit] if result.displacement is not None else [])
    names = [name for fit in fits for name in fit.names]
    return {
        "source": result.measurement.source,
        "model": result.model,
        "headline": headline(result),
        "warnings": result.warnings,
        "fit_picture": _png(identification_figure(result)),
        "parameters": [_parameter(name, p) for name, p in result.parameters.items()],
        "derived": [{"name": n, "value": format_quantity(p.value, p.unit, 5)} for n, p in result.derived.items()],
        "candidates": [
            {
                "model": c.model,
                "parameters": len(c.fit.fit.values) if c.fit else "",
                "rmse": f"{c.fit.fit.rmse / peak:.2%}" if c.fit else "",
                "bic": f"{c.bic - best:.1f}" if c.bic is not None else "",
                "verdict": c.verdict,
                "chosen": c.chosen,
            }
            for c in result.candidates
        ],
        "windows": [
            {
                "window": f"{format_quantity(w.start, 's', 3)} to {format_quantity(w.end, 's', 3)}",
                "samples": w.count,
                "rms": format_quantity(w.rms, "A", 3),
                "share": f"{w.rms / peak:.2%}",
            }
            for w in result.residual_windows["current"]
        ],
        "correlation_picture": _png(_correlation_figure(result)),
        "names": names,
        "matrix": _matrix(result, names),
        "statistics": json.dumps(result.statistics, indent=2),
        "actuator": dumps(result.actuator),
        "netlist": str(strip_netlist(result.actuator, beam="static").to_pyspice()),
        "command": command or "ilg-circuit identify " + result.measurement.source,
        "versions": ", ".join(
            [f"Python {platform.python_version()}", *(f"{name} {version(name)}" for name in _PACKAGES)]
        ),
    }


def _parameter(name: str, p: Parameter) -> dict[str, str]:
    row = {"name": name, "value": format_quantity(p.value, p.unit, 5), "error": "held", "interval": p.held}
    if p.stderr is not None:
        error, interval = p.honest
        row["error"] = format_quantity(error, p.unit, 2) + (" (blocks)" if p.bootstrap is not None else "")
        row["interval"] = " to ".join(format_quantity(x, p.unit, 5) for x in interval)
    return row


def _matrix(result: Identification, names: list[str]) -> list[dict[str, Any]]:
    """The correlations as a full table; blank between parameters of different fits."""
    rows = []
    for a in names:
        cells = []
        for b in names:
            value = 1.0 if a == b else result.correlations.get(f"{a}, {b}", result.correlations.get(f"{b}, {a}"))
            cells.append("" if value is None else f"{value:+.2f}")
        rows.append({"name": a, "cells": cells})
    return rows


def _correlation_figure(result: Identification) -> Figure:
    """Bars over the lag, with the band that white noise would stay in."""
    parts = [("current", result.current.fit.residuals)]
    if result.displacement is not None:
        parts.append(("displacement", result.displacement.fit.residuals))
    figure, axes = new_figure(len(parts), [1.6] * len(parts))
    for panel, (name, residuals) in zip(axes, parts, strict=True):
        values = autocorrelations(residuals)
        panel.axhspan(-1.96 / np.sqrt(len(residuals)), 1.96 / np.sqrt(len(residuals)), color=GREY, alpha=0.25, lw=0)
        panel.vlines(np.arange(len(values)), 0.0, values, color=BLUE, linewidth=2.0)
        panel.axhline(0.0, color=GREY, linewidth=0.8)
        panel.set_ylabel(name)
        panel.set_ylim(min(-0.3, float(values.min()) - 0.05), 1.05)
    axes[-1].set_xlabel("lag [samples]; grey: 95 % of white noise")
    return figure


def _png(figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    return base64.b64encode(buffer.getvalue()).decode("ascii")
