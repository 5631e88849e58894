"""Presents a fitted law of sensing: its parameters, the ratio to reciprocity, the records with their fit."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..identification.sensing import SensingFit
from ..strip.file import save_actuator
from ..units import format_quantity
from . import estimates
from .axes import BLUE, GREY, Axes, Figure, Panels, curve, heading, new_figure


def headline(fit: SensingFit) -> str:
    """Return one line: the strip, the records, their terminals."""
    records = ", ".join(f"{r.source} ({r.terminals} terminals)" for r in fit.records)
    return f"sensing of {fit.actuator.name} from {records}"


def facts(fit: SensingFit) -> list[tuple[str, str]]:
    """Return the parameters with their errors, the ratio and the residuals."""
    return [*estimates.estimate_facts(fit.parameters), *_closing(fit)]


def summary(fit: SensingFit) -> str:
    """Return parameters with errors and intervals, the ratio and the residuals."""
    lines = [headline(fit), "", estimates.HEADER]
    lines += [estimates.estimate_line(name, e) for name, e in fit.parameters.items()]
    lines += [*estimates.method_lines(fit.parameters), ""]
    return "\n".join([*lines, *(f"{name}: {value}" for name, value in _closing(fit))])


def figure(fit: SensingFit) -> Figure:
    """Return for each record the signal with its fit, the motion beneath."""
    count = len(fit.records)
    drawn, panels = new_figure(2 * count, [1.6, 0.8] * count)
    for k in range(count):
        _signal(fit, k, panels[2 * k])
        _motion(fit, k, panels[2 * k + 1])
    panels[-1].set_xlabel("time [s]")
    drawn.align_ylabels(panels)
    heading(drawn, headline(fit))
    return drawn


def panels(fit: SensingFit) -> Panels:
    """Return the panels: signal and motion of each record, numbered where there are several."""
    found: dict[str, Any] = {}
    for k in range(len(fit.records)):
        ending = f"_{k + 1}" if len(fit.records) > 1 else ""
        found[f"signal{ending}"] = partial(_over_time, _signal, fit, k)
        found[f"motion{ending}"] = partial(_over_time, _motion, fit, k)
    return found


def write_strip(fit: SensingFit, path: str | Path) -> None:
    """Write the strip with its law of sensing as TOML, with its origin as a comment."""
    comment = [
        f"sensing fitted by ilg_circuit {__version__} to {', '.join(r.source for r in fit.records)}",
        *(f"{name}: {value}" for name, value in _closing(fit)),
        *(f"warning: {line}" for line in fit.warnings),
    ]
    save_actuator(fit.actuator, path, "\n".join(comment), fit.provenance)


def _over_time(draw: Any, fit: SensingFit, k: int, panel: Axes, **style: Any) -> Axes:
    draw(fit, k, panel, **style)
    panel.set_xlabel("time [s]")
    return panel


def _signal(fit: SensingFit, k: int, panel: Axes, **style: Any) -> None:
    """Draw the measured signal of a record, and the fit."""
    record = fit.records[k]
    look = {"color": BLUE, "linewidth": 1.4, "label": "fit"} | style
    factor = curve(panel, record.time, fit.fitted(k), record.quantity, record.unit, **look)
    label = f"measured, {record.source}"
    panel.plot(record.time, factor * record.signal, ".", color=GREY, markersize=2.5, zorder=1, label=label)
    panel.legend(frameon=False, fontsize="small", loc="upper right")


def _motion(fit: SensingFit, k: int, panel: Axes, **style: Any) -> None:
    record = fit.records[k]
    curve(panel, record.time, record.displacement, "displacement", "m", **{"color": GREY} | style)


def _closing(fit: SensingFit) -> list[tuple[str, str]]:
    ratio = "unknown: the strip has no [coupling]" if fit.ratio is None else f"{fit.ratio:.3g}"
    found = [("measured over reciprocal", ratio)]
    for k, record in enumerate(fit.records):
        rms, span = float(np.sqrt(np.mean(fit.fit.residuals_of(k) ** 2))), float(np.ptp(record.signal))
        text = f"{format_quantity(rms, record.unit, 3)}, {rms / span:.2%} of its span"
        found.append((f"rms of the residuals of {record.source}", text))
    return found
