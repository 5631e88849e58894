"""Draws a fitted spectrum: Bode plot, residuals, Nyquist plots."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray, Mask
from ..identification.identification import Identification
from ..identification.impedance import ImpedanceData
from .axes import BLUE, FIT, GREY, ORANGE, Axes, Figure, blank, caption, heading, plain, scaled
from .look import narrow

#: A Nyquist plot whose extents have a larger ratio gets different scales along its axes.
_SLENDER = 4.0


def spectrum_figure(result: Identification, data: ImpedanceData) -> Figure:
    """Return a figure: Bode plot, residuals of the fit and of the Kramers-Kronig check, Nyquist plots."""
    drawn = blank((11.0, 8.2), stacked=13.0)
    stacked: dict[str, Any] = {"nrows": 2, "ncols": 1, "height_ratios": [1.6, 1.0]}
    columns: Any = drawn.add_gridspec(
        **(stacked if narrow() else {"nrows": 1, "ncols": 2, "width_ratios": [1.25, 1.0]})
    )
    left = columns[0].subgridspec(4, 1, height_ratios=[1.3, 1.1, 1.0, 1.0])
    upper = drawn.add_subplot(left[0])
    middle, misfit, check = (drawn.add_subplot(left[k], sharex=upper) for k in (1, 2, 3))
    z, f = data.measured.impedance, data.measured.frequency
    bad = data.check.bad
    # if the impedance at the lowest frequencies dwarfs the rest, the rest gets a second plot
    within = _corner(z)
    twice = within < 0.4 * float(np.abs(z).max())
    right = columns[1].subgridspec(2 if twice else 1, 1)
    planes = [drawn.add_subplot(right[k]) for k in range(2 if twice else 1)]
    size(result, upper)
    phase(result, middle)
    (o,) = result.observations
    relative = np.asarray(o.residuals / np.abs(o.data), dtype=complex)
    _parts(misfit, o.abscissa, relative, "fit residual\n[% of abs(Z)]")
    _parts(check, f[~bad], data.check.residuals[~bad], "Kramers-Kronig\nresidual [% of abs(Z)]")
    check.set_xlabel("frequency [Hz]")
    for panel in (upper, middle, misfit):
        panel.tick_params(labelbottom=False)
        panel.set_xlabel("")
    for panel, largest in zip(planes, (None, within), strict=False):
        nyquist(result, panel, largest)
    for panel in (upper, middle, misfit, check, *planes):
        plain(panel)
    drawn.align_ylabels([upper, middle, misfit, check])
    share = data.relative_rms(result.fit.residuals_of(0))
    heading(drawn, f"{data.source}: model {result.model}, {share:.2%} rms")
    return drawn


def _spectra(result: Identification) -> tuple[Array, ComplexArray, Mask, Array, ComplexArray]:
    """Return frequency, measured impedance, mask of points left out; dense frequencies and the fit there."""
    data = result.data[0]
    assert result.port is not None
    assert isinstance(data, ImpedanceData)
    f = data.measured.frequency
    dense = np.geomspace(f[0], f[-1], 400)
    fit = result.port.port.impedance(2j * np.pi * dense, ideal=True)
    return f, data.measured.impedance, data.check.bad, dense, fit


def _points(panel: Axes, x: Array, y: Array, bad: Mask) -> None:
    panel.plot(x[~bad], y[~bad], "o", color=GREY, markersize=3.5, label="measured")
    if bad.any():
        panel.plot(x[bad], y[bad], "x", color=ORANGE, markersize=6, label="left out")


def size(result: Identification, panel: Axes, **style: Any) -> Axes:
    """Draw abs(Z) over frequency."""
    f, z, bad, dense, fit = _spectra(result)
    factor, label = scaled(panel.yaxis, np.abs(z), "\N{OHM SIGN}")
    _points(panel, f, factor * np.abs(z), bad)
    panel.loglog(dense, factor * np.abs(fit), **FIT | style)
    panel.set(xlabel="frequency [Hz]", ylabel=f"abs(Z) [{label}]")
    panel.legend(frameon=False, fontsize="small")
    return panel


def phase(result: Identification, panel: Axes, **style: Any) -> Axes:
    """Draw the phase over frequency."""
    f, z, bad, dense, fit = _spectra(result)
    _points(panel, f, np.degrees(np.angle(z)), bad)
    panel.semilogx(dense, np.degrees(np.angle(fit)), **FIT | style)
    panel.set(xlabel="frequency [Hz]", ylabel="phase [deg]")
    return panel


def _parts(panel: Any, f: Array, relative: ComplexArray, name: str) -> None:
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.semilogx(f, 100 * relative.real, "o-", color=BLUE, markersize=2.5, linewidth=0.8, label="real part")
    panel.semilogx(f, 100 * relative.imag, "s-", color=ORANGE, markersize=2.5, linewidth=0.8, label="imaginary part")
    panel.set_ylabel(name)
    panel.legend(frameon=False, fontsize="small", ncols=2)


def nyquist(result: Identification, panel: Axes, largest: float | None = None, **style: Any) -> Axes:
    """Draw -Im Z over Re Z, limited to abs(Z) <= ``largest`` [ohm] if given."""
    _, z, bad, _, fit = _spectra(result)
    shown = np.abs(z) if largest is None else np.array([largest])
    factor, label = scaled(panel.xaxis, shown, "\N{OHM SIGN}")
    _points(panel, factor * z.real, -factor * z.imag, bad)
    panel.plot(factor * fit.real, -factor * fit.imag, **FIT | style)
    panel.set_xlabel(f"Re Z [{label}]")
    panel.set_ylabel(f"-Im Z [{label}]")
    panel.set_aspect("equal", adjustable="box" if largest else "datalim")
    if largest is None:
        caption(panel, "Nyquist")
        return panel
    inside = factor * z[np.abs(z) <= largest]
    wide, high = float(np.ptp(inside.real)), float(np.ptp(inside.imag))
    rooms = (0.05 * (wide + high),) * 2
    if max(wide, high) > _SLENDER * min(wide, high):
        panel.set_aspect("auto")  # with equal scales it would be a line
        rooms = 0.1 * wide, 0.1 * high
    panel.set_xlim(float(inside.real.min()) - rooms[0], float(inside.real.max()) + rooms[0])
    panel.set_ylim(-float(inside.imag.max()) - rooms[1], -float(inside.imag.min()) + rooms[1])
    caption(panel, "Nyquist, upper frequencies")
    return panel


def _corner(z: ComplexArray) -> float:
    """Return the abs(Z) [ohm] below which the upper two thirds of the frequencies lie."""
    return 1.1 * float(np.max(np.abs(z)[len(z) // 3 :]))
