"""Presents the resistance along a strip from spectra: the parameters, the verdict, the spectra with the fit."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..fit.estimate import Estimate
from ..identification.sheets import SheetsFit
from ..units import format_quantity
from . import estimates
from .axes import COLOURS, GREY, Axes, Figure, Panels, blank, heading, plain, scaled
from .look import narrow

_OHM = "\N{OHM SIGN}"


def headline(fit: SheetsFit) -> str:
    """Return one line: the lengths, the contact, the model."""
    lengths = ", ".join(format_quantity(length, "m", 4) for length in fit.lengths)
    where = "one end" if fit.contact == "end" else "both ends"
    return f"sheets of a strip from {_spectra(len(fit.data))} of {lengths}, contact at {where}, model {fit.model}"


def facts(fit: SheetsFit) -> list[tuple[str, str]]:
    """Return the parameters with their errors, the largest gamma L, the verdict, and the residuals."""
    return [*estimates.estimate_facts(_known(fit)), *_closing(fit)]


def summary(fit: SheetsFit) -> str:
    """Return parameters with errors and intervals, the largest gamma L, the verdict, and the residuals."""
    lines = [headline(fit), "", estimates.HEADER]
    lines += [estimates.estimate_line(name, e) for name, e in _known(fit).items()]
    lines += [*estimates.method_lines(_known(fit)), ""]
    lines += [f"The port is that of {format_quantity(fit.length, 'm', 4)} of the strip without its sheets."]
    return "\n".join([*lines, *(f"{name} {value}" for name, value in _closing(fit))])


def figure(fit: SheetsFit) -> Figure:
    """Return the spectra with the fit, over frequency and in the plane, and the residuals."""
    drawn = blank((10.0, 5.6), stacked=10.0)
    if narrow():
        size, left, plane = drawn.subplots(3, 1, height_ratios=[1.0, 0.8, 1.4])
    else:
        grid = drawn.add_gridspec(2, 2, width_ratios=[1.15, 1.0], height_ratios=[1.6, 1.0])
        size, left, plane = (drawn.add_subplot(grid[place]) for place in ((0, 0), (1, 0), (slice(None), 1)))
    _size(fit, size)
    size.set_xlabel("")
    _residuals(fit, left)
    _nyquist(fit, plane)
    drawn.align_ylabels([size, left])
    heading(drawn, headline(fit))
    return drawn


def panels(fit: SheetsFit) -> Panels:
    """Return the panels: size over frequency, Nyquist plot, residuals."""
    return {"size": partial(_size, fit), "nyquist": partial(_nyquist, fit), "residuals": partial(_residuals, fit)}


def _known(fit: SheetsFit) -> dict[str, Estimate]:
    return {name: e for table in fit.estimate_tables().values() for name, e in table.items()}


def _spectra(count: int) -> str:
    return "a spectrum" if count == 1 else f"{count} spectra"


def _closing(fit: SheetsFit) -> list[tuple[str, str]]:
    rms = max(d.relative_rms(fit.fit.residuals_of(k)) for k, d in enumerate(fit.data))
    return [
        ("largest abs(gamma L)", f"{fit.gamma_length:.3g}"),
        ("separable", "yes" if fit.separable else "no"),
        ("rms of the residuals", f"{rms:.3g} of abs(Z)"),
    ]


def _label(fit: SheetsFit, k: int) -> str:
    return format_quantity(fit.lengths[k], "m", 4)


def _size(fit: SheetsFit, panel: Axes, **style: Any) -> Axes:
    """Draw abs(Z) of the spectra and of the fit over frequency."""
    every = np.concatenate([d.spectrum.modulus for d in fit.data])
    factor, unit = scaled(panel.yaxis, every, _OHM)
    for k, d in enumerate(fit.data):
        colour = COLOURS[k % len(COLOURS)]
        panel.loglog(d.abscissa, factor * d.spectrum.modulus, "o", color=colour, markersize=3, label=_label(fit, k))
        panel.loglog(d.abscissa, factor * np.abs(fit.fitted(k)), **{"color": colour, "linewidth": 1.2} | style)
    panel.set(xlabel="frequency [Hz]", ylabel=f"abs(Z) [{unit}]")
    panel.legend(frameon=False, fontsize="small")
    plain(panel)
    return panel


def _nyquist(fit: SheetsFit, panel: Axes, **style: Any) -> Axes:
    """Draw -Im Z over Re Z of the spectra and of the fit."""
    every = np.concatenate([d.spectrum.modulus for d in fit.data])
    factor, unit = scaled(panel.xaxis, every, _OHM)
    for k, d in enumerate(fit.data):
        z, fitted, colour = factor * d.spectrum.impedance, factor * fit.fitted(k), COLOURS[k % len(COLOURS)]
        look: dict[str, Any] = {"color": colour, "linewidth": 1.2} | style
        panel.plot(z.real, -z.imag, "o", color=colour, markersize=3, label=_label(fit, k))
        panel.plot(fitted.real, -fitted.imag, **look)
    panel.set(xlabel=f"Re Z [{unit}]", ylabel=f"-Im Z [{unit}]")
    panel.set_aspect("equal", adjustable="datalim")
    plain(panel)
    return panel


def _residuals(fit: SheetsFit, panel: Axes, **style: Any) -> Axes:
    """Draw what the fit leaves of real and imaginary parts, over abs(Z)."""
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    for k, d in enumerate(fit.data):
        left = 100 * (d.spectrum.impedance - fit.fitted(k)) / d.spectrum.modulus
        look: dict[str, Any] = {"color": COLOURS[k % len(COLOURS)], "markersize": 3.5, "linestyle": "none"} | style
        panel.semilogx(d.abscissa, left.real, **{"marker": "o"} | look)
        panel.semilogx(d.abscissa, left.imag, **{"marker": "x"} | look)
    panel.set(xlabel="frequency [Hz]", ylabel="residuals, Re (o), Im (x)\n[% of abs(Z)]")
    plain(panel)
    return panel
