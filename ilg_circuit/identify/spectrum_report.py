"""An identified spectrum as text, files and a picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..arrays import ComplexArray
from ..files import write_text
from ..report.plots import BLUE, GREY, ORANGE, engineering, save
from ..strip.file import dumps
from ..units import format_quantity
from .report import _plus_minus, _row, _text, method_lines
from .spectrum_identification import Candidate, SpectrumIdentification

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


def spectrum_table(result: SpectrumIdentification) -> str:
    """The result for a terminal: the check, parameters with errors and intervals, statistics, the candidates."""
    check, fit = result.check, result.fit
    lines = [
        spectrum_headline(result),
        f"Kramers-Kronig: residuals {check.rms:.2%} rms of abs(Z), {check.terms} time constants",
        "",
        f"{'parameter':<28}{'value':>16}{'standard error':>18}   95 % interval",
    ]
    lines += [_row(name, p) for name, p in result.parameters.items()]
    lines += method_lines(result.parameters)
    lines += ["", *(f"{name:<28}{_text(p.value, p.unit):>16}" for name, p in result.derived.items())]
    s = result.statistics
    lines += [
        "",
        f"rmse {_text(s['rmse'], 'ohm', 3)}, {fit.relative_rms:.2%} of abs(Z), weighting by {fit.weighting}, "
        f"AIC {s['aic']:.1f}, BIC {s['bic']:.1f}, n {s['n']} ({s['independent']:.0f} of them independent)",
    ]
    strong = [f"{pair}: {value:+.3f}" for pair, value in result.correlations.items() if abs(value) > 0.9]
    if strong:
        lines.append(f"correlations beyond 0.9: {'; '.join(strong)}")
    if len(result.candidates) > 1:
        lines += ["", f"{'model':<10}{'parameters':>11}{'rms of abs(Z)':>15}{'BIC':>10}   against it"]
        lines += [_candidate(c, result.model) for c in result.candidates]
        lines.append("BIC on as many readings as are independent; the chosen model is marked")
    return "\n".join(lines)


def spectrum_headline(result: SpectrumIdentification) -> str:
    """What was measured, and the model."""
    f = result.spectrum.frequency
    low, high = (format_quantity(float(x), "Hz", 4) for x in (f[0], f[-1]))
    return f"{result.spectrum.source}: spectrum of {len(f)} points, {low} to {high}; model {result.model}, closed form"


def write_spectrum_json(result: SpectrumIdentification, path: str | Path) -> None:
    """Write fit.json, whole or not at all."""
    write_text(Path(path), json.dumps(result.to_json(), indent=2, allow_nan=False) + "\n")


def write_spectrum_actuator(result: SpectrumIdentification, path: str | Path) -> None:
    """Write the fitted actuator as TOML; its comment says where it comes from."""
    comment = "\n".join(
        [
            f"fitted by ilg_circuit {__version__} to the spectrum {result.spectrum.source}, model {result.model}",
            *(f"{n} = {_text(p.value, p.unit)}{_plus_minus(p)}" for n, p in result.parameters.items()),
            *(f"warning: {line}" for line in result.warnings),
        ]
    )
    write_text(Path(path), dumps(result.actuator, comment))


def plot_spectrum(result: SpectrumIdentification, path: str | Path) -> None:
    """Write `spectrum_figure` as a picture."""
    save(spectrum_figure(result), path)


def spectrum_figure(result: SpectrumIdentification) -> Figure:
    """Bode plot, residuals of the fit and of the Kramers-Kronig check over frequency; Nyquist plots beside them."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 8.2), dpi=150, layout="constrained")
    columns = figure.add_gridspec(1, 2, width_ratios=[1.25, 1.0])
    left = columns[0].subgridspec(4, 1, height_ratios=[1.3, 1.1, 1.0, 1.0])
    size = figure.add_subplot(left[0])
    phase, misfit, check = (figure.add_subplot(left[k], sharex=size) for k in (1, 2, 3))
    # where the lowest frequencies dwarf the others, these have a plot of their own
    within = _corner(result.spectrum.impedance)
    twice = within < 0.4 * float(result.spectrum.modulus.max())
    right = columns[1].subgridspec(2 if twice else 1, 1)
    planes = [figure.add_subplot(right[k]) for k in range(2 if twice else 1)]
    _bode(result, size, phase)
    sound = ~result.check.bad
    f, z = result.spectrum.frequency[sound], result.spectrum.impedance[sound]
    _residuals(misfit, f, result.fit.residuals / np.abs(z), "fit residual\n[% of abs(Z)]")
    _residuals(check, f, result.check.residuals[sound], "Kramers-Kronig\nresidual [% of abs(Z)]")
    check.set_xlabel("frequency [Hz]")
    for panel in (size, phase, misfit):
        panel.tick_params(labelbottom=False)
    for panel, largest in zip(planes, (None, within), strict=False):
        _nyquist(result, panel, largest)
    for panel in (size, phase, misfit, check, *planes):
        panel.grid(alpha=0.25, linewidth=0.6)
        panel.spines[["top", "right"]].set_visible(False)
    figure.align_ylabels([size, phase, misfit, check])
    figure.suptitle(f"{result.spectrum.source}: model {result.model}, {result.fit.relative_rms:.2%} rms", fontsize=10)
    return figure


def _candidate(c: Candidate, chosen: str) -> str:
    mark = " <- chosen" if c.model == chosen else ""
    if c.fit is None:
        return f"{c.model:<10}{'-':>11}{'-':>15}{'-':>10}   {c.against}"
    return f"{c.model:<10}{c.fit.fit.count:>11}{c.fit.relative_rms:>15.2%}{c.bic:>10.1f}   {c.against}{mark}"


def _bode(result: SpectrumIdentification, size: Any, phase: Any) -> None:
    s, bad = result.spectrum, result.check.bad
    factor, label = engineering(s.modulus, "\N{OHM SIGN}")
    f = s.frequency
    size.loglog(f[~bad], factor * s.modulus[~bad], "o", color=GREY, markersize=3.5, label="measured")
    phase.semilogx(f[~bad], np.degrees(np.angle(s.impedance[~bad])), "o", color=GREY, markersize=3.5)
    if bad.any():
        size.loglog(f[bad], factor * s.modulus[bad], "x", color=ORANGE, markersize=6, label="left out")
        phase.semilogx(f[bad], np.degrees(np.angle(s.impedance[bad])), "x", color=ORANGE, markersize=6)
    dense, z = _fitted(result)
    size.loglog(dense, factor * np.abs(z), color=BLUE, linewidth=1.5, label="fit")
    phase.semilogx(dense, np.degrees(np.angle(z)), color=BLUE, linewidth=1.5)
    size.set_ylabel(f"abs(Z) [{label}]")
    phase.set_ylabel("phase [deg]")
    size.legend(frameon=False, fontsize=8)


def _residuals(panel: Any, f: Array, relative: ComplexArray, name: str) -> None:
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.semilogx(f, 100 * relative.real, "o-", color=BLUE, markersize=2.5, linewidth=0.8, label="real part")
    panel.semilogx(f, 100 * relative.imag, "s-", color=ORANGE, markersize=2.5, linewidth=0.8, label="imaginary part")
    panel.set_ylabel(name)
    panel.legend(frameon=False, fontsize=7, ncols=2)


def _nyquist(result: SpectrumIdentification, panel: Any, largest: float | None = None) -> None:
    """-Im Z over Re Z; ``largest`` [ohm]: only what lies within it."""
    s, bad = result.spectrum, result.check.bad
    shown = s.modulus if largest is None else np.array([largest])
    factor, label = engineering(shown, "\N{OHM SIGN}")
    for points, style, name in (
        (s.impedance[~bad], {"marker": "o", "color": GREY, "markersize": 3.5, "linestyle": ""}, "measured"),
        (s.impedance[bad], {"marker": "x", "color": ORANGE, "markersize": 6, "linestyle": ""}, "left out"),
        (_fitted(result)[1], {"color": BLUE, "linewidth": 1.5}, "fit"),
    ):
        if len(points):
            panel.plot(factor * points.real, -factor * points.imag, **style, label=name)
    panel.set_xlabel(f"Re Z [{label}]")
    panel.set_ylabel(f"-Im Z [{label}]")
    panel.set_aspect("equal", adjustable="box" if largest else "datalim")
    if largest is None:
        panel.set_title("Nyquist", fontsize=9, loc="left")
        return
    inside = factor * s.impedance[s.modulus <= largest]
    room = 0.05 * float(np.ptp(inside.real) + np.ptp(inside.imag))
    panel.set_xlim(float(inside.real.min()) - room, float(inside.real.max()) + room)
    panel.set_ylim(-float(inside.imag.max()) - room, -float(inside.imag.min()) + room)
    panel.set_title("Nyquist, upper frequencies", fontsize=9, loc="left")


def _fitted(result: SpectrumIdentification) -> tuple[Array, ComplexArray]:
    """Frequencies [Hz], close together, and the fit there [ohm]."""
    f = result.spectrum.frequency
    dense = np.geomspace(f[0], f[-1], 400)
    return dense, result.fit.port.impedance(2j * np.pi * dense, ideal=True)


def _corner(z: ComplexArray) -> float:
    """A size [ohm] within which the upper two thirds of the frequencies lie."""
    size = np.abs(z)
    return 1.1 * float(np.max(size[len(z) // 3 :]))
