"""Draws how a strip follows a goal: displacement, or force, and goal, error, voltage, current over time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

from ..arrays import Array
from .axes import GREY, ORANGE, Axes, Figure, Panels, curve, heading, legend_above, new_figure
from .response import over_time


class Followed(Protocol):
    """A result of which something follows a goal under a voltage, each over ``time`` (n,)."""

    @property
    def time(self) -> Array: ...
    @property
    def voltage(self) -> Array: ...
    @property
    def current(self) -> Array: ...


#: What follows: the name of the quantity, its values (n,), their unit.
Wave = tuple[str, Array, str]
#: Draws more into the panel of what follows, which is drawn times a factor.
More = Callable[[Axes, float], None]


def panels(found: Followed, wave: Wave, goal: Array, name: str, limit: float, more: More, **volts: Any) -> Panels:
    """Return the panels: the ``wave`` with its ``goal`` of a ``name``, error, voltage to a limit [V], current.

    ``more`` draws more into the first; ``volts`` style the voltage.
    """

    quantity, values, unit = wave

    def following(panel: Axes, **style: Any) -> None:
        own = {"label": quantity} | style
        factor = curve(panel, found.time, values, quantity, unit, **own)
        panel.plot(found.time, factor * goal, color=GREY, linestyle="--", linewidth=1.2, label=name)
        more(panel, factor)
        legend_above(panel)

    def error(panel: Axes, **style: Any) -> None:
        curve(panel, found.time, goal - values, "error", unit, **style)
        panel.axhline(0.0, color=GREY, linewidth=0.8)

    def voltage(panel: Axes, **style: Any) -> None:
        curve(panel, found.time, found.voltage, "voltage", "V", **{"color": ORANGE} | volts | style)
        at_limit(panel, limit)

    def current(panel: Axes, **style: Any) -> None:
        curve(panel, found.time, found.current, "current", "A", **style)

    drawn = {quantity: following, "error": error, "voltage": voltage, "current": current}
    return {panel: partial(over_time, draw) for panel, draw in drawn.items()}


def at_limit(panel: Axes, limit: float) -> None:
    """Draw the limits of a voltage [V]."""
    for level in (-limit, limit):
        panel.axhline(level, color=GREY, linestyle=":", linewidth=1.0)


def figure(drawn: Panels, title: str) -> Figure:
    """Return the picture of what follows, error and voltage, and of what there is further."""
    names = [name for name in drawn if name != "current"]
    figure, axes = new_figure(len(names), [1.8, 1.1, *[1.3] * (len(names) - 2)])
    for panel, name in zip(axes, names, strict=True):
        drawn[name](panel)
        panel.set_xlabel("")
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    heading(figure, title)
    return figure
