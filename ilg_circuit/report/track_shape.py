"""Presents the voltages of segments for a shape: what can be followed, the errors, the limits, the shape."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..control.tracked_shape import path_rate, unit_of
from ..simulation.curvature import Curvatures
from ..simulation.shape import along, arcs
from ..units import format_quantity
from .axes import COLOURS, GREY, Axes, Figure, Panels, curve, heading, legend_above, new_figure, plain, scaled
from .followed import at_limit
from .page import Listing, Page, Section, picture
from .response import over_time
from .tables import aligned

if TYPE_CHECKING:
    from ..control.tracked_shape import TrackedShape

_NORMAL_95 = 1.96
#: Points along the strip, and strips that are drawn.
_POINTS, _STRIPS = 61, 5
#: Half the least range of a panel, in parts of the size of what it shows.
_LEAST = 0.02
#: Largest number of curves that are named in a legend.
_NAMED = 8


def headline(tracked: TrackedShape) -> str:
    """Return one line: the path, the strip, the voltages."""
    count = len(tracked.limits)
    volts = sorted({of.voltage for of in tracked.limits})
    limit = " to ".join(format_quantity(v, "V", 4) for v in dict.fromkeys((volts[0], volts[-1])))
    by = "one voltage" if count == 1 else f"{count} voltages"
    return f"{tracked.response.netlist.title}: a shape by {by} within {limit}, {tracked.time[-1]:g} s"


def facts(tracked: TrackedShape) -> list[tuple[str, str]]:
    """Return whether the path can be followed, the strip's reach beside the path's, errors, limits of each segment."""
    at = format_quantity(float(tracked.time[tracked.farthest]), "s", 4)
    held = f"can be held at rest within {tracked.at_rest:.2%}" if tracked.at_rest > 1e-6 else "can be held at rest"
    found = [
        ("followed", "yes, within 1 %" if tracked.followed else "no"),
        ("farthest", f"the path's shape at {at} {held}"),
    ]
    sizes, rms = tracked.sizes, tracked.rms
    for name, error in tracked.errors.items():
        unit, worst = unit_of(name), float(np.abs(error).max())
        path = _and_rate(float(np.abs(tracked.paths[name]).max()), path_rate(tracked, name), unit)
        strip = _and_rate(tracked.reach[name], tracked.rate[name], unit)
        off = (
            f"largest {format_quantity(worst, unit, 3)} ({worst / sizes[name]:.2%}), rms "
            f"{format_quantity(rms[name], unit, 3)} ({rms[name] / sizes[name]:.2%})"
        )
        if name in tracked.stderr:
            off += f", standard error up to {format_quantity(float(tracked.stderr[name].max()), unit, 3)}"
        found.append((name, f"path {path}; strip {strip}; error {off}"))
    currents = tracked.currents
    for (name, volts), share in zip(tracked.voltages.items(), tracked.at_limit, strict=True):
        most = format_quantity(float(np.abs(volts).max()), "V", 4)
        flowing = format_quantity(float(np.abs(currents[name]).max()), "A", 3)
        of = "segments" if tracked.alike else f"segment {name}"
        found.append((of, f"up to {most}, {flowing}; at a limit {share:.0%} of the time"))
    found.append(("energy", format_quantity(tracked.energy, "J", 4)))
    if tracked.bound is not None:
        sooner = format_quantity(tracked.bound, "s", 4)
        found.append(("soonest", f"no voltages settle at the path's farthest shape sooner than {sooner}"))
    return found


def _and_rate(value: float, rate: float, unit: str) -> str:
    moving = f"{1e3 * rate:.4g} mm/s" if unit == "m" else f"{rate:.4g} {unit.replace('1/m', '1/(m s)')}"
    return f"{format_quantity(value, unit, 4)}, {moving}{'/s' if unit == 'rad' else ''}"


def summary(tracked: TrackedShape) -> str:
    """Return the headline and the facts as lines."""
    return "\n".join([headline(tracked), *aligned(facts(tracked), "<<")])


def figure(tracked: TrackedShape) -> Figure:
    """Return targets and path, errors, voltages over time, and the strip at some instants."""
    drawn = panels(tracked)
    names = [name for name in drawn if name != "current"]
    heights = [1.5 if name in _KINDS else {"error": 0.9, "voltage": 1.3}.get(name, 1.7) for name in names]
    figure, axes = new_figure(len(names), heights)
    for panel, name in zip(axes, names, strict=True):
        if name == "shape":  # its abscissa is a length
            spec = panel.get_subplotspec()
            panel.remove()
            assert spec is not None
            panel = figure.add_subplot(spec)
        drawn[name](panel)
        if name == "voltage":  # the last one over time
            panel.tick_params(labelbottom=True)
        elif name != "shape":
            panel.set_xlabel("")
    figure.align_ylabels(axes[:-1])
    heading(figure, headline(tracked))
    return figure


#: Panels of targets: what they show, and its unit.
_KINDS = {"displacement": "m", "angle": "rad", "curvature": "1/m"}


def panels(tracked: TrackedShape) -> Panels:
    """Return the panels: each kind of target with its path, errors, voltages, currents, the strip's shape."""
    kinds = [kind for kind, unit in _KINDS.items() if any(unit_of(name) == unit for name in tracked.paths)]
    drawn: dict[str, Any] = {kind: partial(_targets, tracked, kind) for kind in reversed(kinds)}
    drawn |= {"error": partial(_error, tracked), "voltage": partial(_voltage, tracked)}
    drawn["current"] = partial(_current, tracked)
    return {name: partial(over_time, draw) for name, draw in drawn.items()} | {"shape": partial(_shape, tracked)}


def _colour(target: str) -> str:
    """Return the colour of a target: that of its segment, or one after those."""
    kind, _, number = target.partition("_")
    return COLOURS[(int(number) - 1 if number else {"displacement": -2, "angle": -1}[kind]) % len(COLOURS)]


def _named(names: list[str], name: str, label: str) -> str:
    """Return a curve's label, none for those between the first and the last of many."""
    return label if len(names) <= _NAMED or name in (names[0], names[-1]) else f"_{label}"


def _targets(tracked: TrackedShape, kind: str, panel: Axes, **style: Any) -> None:
    """Draw the targets of a kind, each in the colour of its segment, and their paths on them."""
    unit = _KINDS[kind]
    names = [name for name in tracked.paths if unit_of(name) == unit]
    outputs = tracked.outputs
    least = _LEAST * max(tracked.sizes[n] for n in names)  # of a path that stays zero
    every = np.concatenate([[least], *(tracked.paths[n] for n in names), *(outputs[n] for n in names)])
    factor, label = (1.0, unit) if unit == "1/m" else scaled(panel.yaxis, every, unit)
    for name in names:
        colour = _colour(name)
        said = f"segment {name.partition('_')[2]}" if "_" in name else name
        look: dict[str, Any] = {"color": colour, "linewidth": 1.4, "label": _named(names, name, said)} | style
        panel.plot(tracked.time, factor * outputs[name], **look)
        if name in tracked.stderr:
            reach = _NORMAL_95 * tracked.stderr[name]
            low, high = (factor * (outputs[name] + sign * reach) for sign in (-1, 1))
            panel.fill_between(tracked.time, low, high, color=colour, alpha=0.25, linewidth=0)
        path = "path" if name == names[-1] else "_"
        panel.plot(tracked.time, factor * tracked.paths[name], color=GREY, linestyle="--", linewidth=1.1, label=path)
    if float(np.abs(every).max()) == least:
        panel.set_ylim(-factor * least, factor * least)
    panel.set_ylabel(f"{kind} [{label}]")
    legend_above(panel)


def _error(tracked: TrackedShape, panel: Axes, **style: Any) -> None:
    """Draw the errors in parts of what they count against."""
    sizes = tracked.sizes
    for name, error in tracked.errors.items():
        look: dict[str, Any] = {"color": _colour(name), "linewidth": 1.2} | style
        panel.plot(tracked.time, 100 * error / sizes[name], **look)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.set_ylabel("error [%]")
    plain(panel)


def _voltage(tracked: TrackedShape, panel: Axes, **style: Any) -> None:
    """Draw the voltage of each segment, and the limits."""
    _of_segments(tracked, tracked.voltages, ("voltage", "V"), panel, **style)
    for limit in {of.voltage for of in tracked.limits}:
        at_limit(panel, limit)


def _current(tracked: TrackedShape, panel: Axes, **style: Any) -> None:
    """Draw the current into each segment."""
    _of_segments(tracked, tracked.currents, ("current", "A"), panel, **style)


def _of_segments(
    tracked: TrackedShape, waves: dict[str, Array], what: tuple[str, str], panel: Axes, **style: Any
) -> None:
    names = list(waves)
    scaled(panel.yaxis, np.concatenate([*waves.values()]), what[1])
    for k, (name, values) in enumerate(waves.items()):
        label = _named(names, name, "all segments" if tracked.alike else f"segment {name}")
        curve(panel, tracked.time, values, *what, **{"color": COLOURS[k % len(COLOURS)], "label": label} | style)
    legend_above(panel)


def _shape(tracked: TrackedShape, panel: Axes, **style: Any) -> Axes:
    """Draw the strip at some instants as its free curvatures bend it, and where the path tells it the path's shape."""
    bent = tracked.response.curvatures
    assert bent is not None
    wanted = _path_shape(tracked)
    places = along(bent, _POINTS)
    scale, unit = scaled(panel.xaxis, places, "m")
    instants = np.unique(np.append(np.linspace(0, len(tracked.time) - 1, _STRIPS).astype(int)[1:], tracked.farthest))
    for k, (instant, colour) in enumerate(zip(instants, COLOURS, strict=False)):
        x, y, _ = arcs(Curvatures(bent.time[[instant]], bent.lengths, bent.values[[instant]]), places)
        look: dict[str, Any] = {"color": colour, "linewidth": 1.8, "label": f"{tracked.time[instant]:.4g} s"} | style
        panel.plot(scale * x[0], scale * y[0], **look)
        if wanted is not None:
            x, y, _ = arcs(Curvatures(wanted.time[[instant]], wanted.lengths, wanted.values[[instant]]), places)
            label = "path" if k == len(instants) - 1 else "_"
            panel.plot(scale * x[0], scale * y[0], color=GREY, linestyle="--", linewidth=1.1, label=label)
    panel.set_xlabel(f"x [{unit}]")
    panel.set_ylabel(f"y [{unit}]")
    panel.axhline(0.0, color=GREY, linewidth=0.6)
    plain(panel)
    legend_above(panel)
    return panel


def _path_shape(tracked: TrackedShape) -> Curvatures | None:
    """Return the curvatures that a path asks for along the strip; None where it leaves some segments out."""
    sheets, geometry = tracked.actuator.electrodes, tracked.actuator.geometry
    assert sheets is not None
    spans = sheets.spans(1, geometry)
    names = [f"curvature_{k + 1}" for k in range(len(spans))]
    if not set(names) <= set(tracked.paths):
        return None
    lengths, values, last = [], [], 0.0
    for name, (start, end) in zip(names, spans, strict=True):
        for length, wave in ((start - last, np.zeros(len(tracked.time))), (end - start, tracked.paths[name])):
            if length > 1e-9 * geometry.free_length:
                lengths.append(length)
                values.append(wave)
        last = end
    if geometry.free_length - last > 1e-9 * geometry.free_length:
        lengths.append(geometry.free_length - last)
        values.append(np.zeros(len(tracked.time)))
    return Curvatures(tracked.time, np.array(lengths), np.stack(values, axis=1))


def page(tracked: TrackedShape) -> Page:
    """Return a page: the picture and the summary."""
    drawn = picture(figure(tracked), "path and targets, errors and voltages over time, the strip at some instants")
    sections = [Section("Path", [drawn, Listing(summary(tracked))])]
    return Page("Voltages for a shape", headline(tracked), facts(tracked), tracked.warnings, sections)
