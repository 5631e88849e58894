"""Plots of responses and fits. Every axis has a name and a unit; the drive runs beneath."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import replacing, require_writable
from ..units import format_quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..identify.comparison import Compared
    from ..simulation.impedance import Impedance
    from ..simulation.response import Response
    from ..simulation.sensing import Sensed

Array = NDArray[np.float64]

_PREFIXES = ((1e-15, "f"), (1e-12, "p"), (1e-9, "n"), (1e-6, "u"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
BLUE, ORANGE, GREY = "#1f5fa8", "#d1601f", "#6b6b6b"


def engineering(values: Array, unit: str) -> tuple[float, str]:
    """Factor and unit that bring ``values`` [``unit``] to numbers of a readable size."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if largest == 0:
        return 1.0, unit
    size, prefix = max((p for p in _PREFIXES if p[0] <= largest * 1.0001), default=_PREFIXES[0])
    return 1 / size, f"{prefix}{unit}".replace("u", "\N{MICRO SIGN}", 1 if prefix == "u" else 0)


def new_figure(rows: int, heights: list[float], width: float = 7.5) -> tuple[Figure, list[Axes]]:
    """A figure that needs no display, with ``rows`` panels over one time axis."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, 1.0 + sum(heights)), dpi=150, layout="constrained")
    panels: Any = figure.subplots(rows, 1, sharex=True, height_ratios=heights, squeeze=False)
    axes = [panel for row in panels for panel in row]
    for panel in axes:
        panel.grid(alpha=0.25, linewidth=0.6)
        panel.margins(x=0.01)
        panel.spines[["top", "right"]].set_visible(False)
    return figure, axes


def require_picture(path: Path) -> None:
    """Refuse a picture's path before the work is done: its folder, and a suffix that can be drawn."""
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InputError(f"cannot draw '{path}': end its name in .png, .pdf or .svg")
    require_writable(path)


def save(figure: Figure, path: str | Path) -> None:
    """Write the picture, whole or not at all; the suffix (.png, .pdf, .svg) decides the format."""
    target = Path(path)
    require_picture(target)
    with replacing(target) as temporary:
        figure.savefig(temporary, format=target.suffix[1:].lower())


def plot_response(
    response: Response,
    path: str | Path,
    stderr: dict[str, Array] | None = None,
    measured: Sequence[Compared] = (),
) -> None:
    """Current, charge, displacement, force (where they move) and energy over time, the drive beneath.

    With standard errors ``stderr`` the 95 % band of the fit that the strip comes from; what was ``measured`` as points
    beside the prediction that was compared with it.
    """
    shown = [
        (name, unit)
        for name, unit in (("current", "A"), ("charge", "C"), ("displacement", "m"), ("force", "N"), ("energy", "J"))
        if np.nanmax(np.abs(getattr(response, name)), initial=0.0) > 0
    ]
    figure, axes = new_figure(len(shown) + 1, [1.5] * len(shown) + [1.0])
    beside = {part.quantity: part for part in measured}
    for panel, (name, unit) in zip(axes, shown, strict=False):
        values = getattr(response, name)
        factor, label = engineering(values, unit)
        time, error, title = response.time, (stderr or {}).get(name), None
        if name in beside:  # the prediction that was compared: its drive jumps where the record does
            part = beside[name]
            time, values, error, title = part.time, part.predicted, part.stderr, "predicted"
            panel.plot(time, factor * part.measured, ".", color=GREY, markersize=2.5, label=f"measured, {part.source}")
        panel.plot(time, factor * values, color=BLUE, linewidth=1.4, label=title)
        if error is not None:
            half = 1.96 * error
            edges = (factor * (values - half), factor * (values + half))
            panel.fill_between(time, *edges, color=BLUE, alpha=0.25, linewidth=0, label="95 % band of the fit")
        panel.set_ylabel(f"{name} [{label}]")
    if stderr or measured:
        axes[0].legend(frameon=False, fontsize=8)
    axes[-1].plot(response.time, response.voltage, color=ORANGE, linewidth=1.4)
    low, high = min(response.voltage.min(), 0.0), max(response.voltage.max(), 0.0)
    axes[-1].set_ylim(low - 0.08 * (high - low or 1.0), high + 0.08 * (high - low or 1.0))
    axes[-1].set_ylabel("voltage [V]")
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    figure.suptitle(f"{response.netlist.title}: {response.drive.text}", fontsize=10)
    save(figure, path)


def plot_sensed(found: Sensed, path: str | Path) -> None:
    """The terminals' answer and the elastic force over time, the imposed motion beneath."""
    answer = ("voltage", "V") if found.terminals == "open" else ("current", "A")
    shown = (answer, ("force", "N"), ("displacement", "m"))
    figure, axes = new_figure(len(shown), [1.5, 1.5, 1.0])
    for panel, (name, unit) in zip(axes, shown, strict=True):
        values = getattr(found, name)
        factor, label = engineering(values, unit)
        panel.plot(found.time, factor * values, color=ORANGE if name == "displacement" else BLUE, linewidth=1.4)
        panel.set_ylabel(f"{name} [{label}]")
        if np.ptp(values) < 1e-3 * np.abs(values).max():  # all but constant: shown against zero
            panel.set_ylim(*sorted((0.0, 1.08 * factor * float(values[np.argmax(np.abs(values))]))))
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    figure.suptitle(f"{found.actuator.name}, {found.terminals} terminals: {found.motion.text}", fontsize=10)
    save(figure, path)


def plot_impedance(found: Impedance, path: str | Path) -> None:
    """Bode (size and phase over frequency) and Nyquist plot; the electrical port's closed form dashed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.8), dpi=150, layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=[1.15, 1.0])
    size, phase, plane = (figure.add_subplot(grid[place]) for place in ((0, 0), (1, 0), (slice(None), 1)))
    factor, label = engineering(np.abs(found.impedance), "\N{OHM SIGN}")
    curves: tuple[tuple[Any, dict[str, Any], str], ...] = (
        (found.impedance, {"color": BLUE, "linewidth": 1.8}, f"netlist, {found.engine}"),
        (found.port, {"color": ORANGE, "linestyle": "--", "linewidth": 1.2}, "closed form, no motion"),
    )
    for z, style, name in curves:
        size.loglog(found.frequency, np.abs(z), **style, label=name)
        phase.semilogx(found.frequency, np.degrees(np.angle(z)), **style)
        plane.plot(factor * z.real, -factor * z.imag, **style)
    size.set_ylabel("abs(Z) [\N{OHM SIGN}]")
    size.legend(frameon=False, fontsize=8)
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [Hz]")
    plane.set_xlabel(f"Re Z [{label}]")
    plane.set_ylabel(f"-Im Z [{label}]")
    plane.set_aspect("equal", adjustable="datalim")
    labelled: list[complex] = []
    room = 0.06 * factor * float(np.ptp(found.impedance.real) + np.ptp(found.impedance.imag))
    for decade in _whole_decades(found.frequency):
        k = int(np.argmin(np.abs(np.log(found.frequency / decade))))
        z = found.impedance[k] * factor
        if any(abs(z - other) < room for other in labelled):
            continue  # a label there would lie on another
        labelled.append(z)
        plane.plot(z.real, -z.imag, "o", color=BLUE, markersize=4)
        plane.annotate(
            format_quantity(float(decade), "Hz", 3), (z.real, -z.imag), (4, 4), textcoords="offset points", fontsize=8
        )
    for panel in (size, phase, plane):
        panel.grid(alpha=0.25, linewidth=0.6)
        panel.spines[["top", "right"]].set_visible(False)
    figure.suptitle(f"{found.actuator.name}: impedance about {found.bias:g} V", fontsize=10)
    save(figure, path)


def _whole_decades(frequency: Array) -> Array:
    """At most five powers of ten within the frequencies."""
    low, high = np.ceil(np.log10(frequency[0]) - 1e-9), np.floor(np.log10(frequency[-1]) + 1e-9)
    decades = np.arange(low, high + 1)
    return np.asarray(10.0 ** decades[:: max(-(-len(decades) // 5), 1)])
