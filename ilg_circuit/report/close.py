"""Presents a closed loop over time: reference and displacement, error, voltage."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..units import format_quantity
from .axes import GREY, ORANGE, Axes, Figure, Panels, curve, heading, legend_above, new_figure
from .response import over_time

if TYPE_CHECKING:
    from ..control.close import Closed


def headline(closed: Closed) -> str:
    """Return one line: the strip, the controller, how it is in the loop."""
    every = f" every {format_quantity(closed.period, 's', 4)}" if closed.period else ""
    return f"{closed.actuator.name}: {closed.controller}, {closed.form}{every}, {closed.time[-1]:g} s"


def facts(closed: Closed) -> list[tuple[str, str]]:
    """Return where the displacement ends, settling, overshoot, voltage, sensor, engine."""
    run, sensor = closed.run, closed.sensor
    error = closed.reference - closed.displacement
    found = [
        ("at the end", f"{_length(closed.displacement[-1])}, reference {_length(closed.reference[-1])}"),
        ("error", f"rms {_length(np.sqrt(np.mean(error**2)))}, largest {_length(np.abs(error).max())}"),
    ]
    if np.ptp(closed.reference) == 0 and closed.reference[-1]:
        settled = run.settled()
        when = f"in {settled:.4g} s" if np.isfinite(settled) else "not within the run"
        found.append(("settles", f"{when}, overshoot {run.overshoot:.2%}"))
    volts = format_quantity(float(np.abs(closed.voltage).max()), "V", 4)
    found.append(("voltage", f"up to {volts} of {format_quantity(closed.limit, 'V', 4)}"))
    if closed.period:
        late = f"{format_quantity(sensor.delay, 's', 3)} late" if sensor.delay else "at once"
        noise = f", noise {_length(sensor.noise)}" if sensor.noise else ""
        steps = f", in steps of {_length(sensor.quantum)}" if sensor.quantum else ""
        found.append(("sensor", f"{late}{noise}{steps}; {len(closed.waves.sampled)} calls of the controller"))
    if made := closed.circuit:
        off = made.deviations
        law = f"gain {made.gain / 1e3:.4g} V/mm ({off['gain']:+.2%}), reset time {made.reset_time:.4g} s "
        lag = f", weight {made.weight:.4g} with a lag of {made.lag:.4g} s" if made.weight < 1 else ""
        found.append(("of parts", f"{law}({off['reset_time']:+.2%}){lag}, limit {made.limit:.4g} V"))
        count = [sum(part.designator[0] == kind for part in made.parts) for kind in "URCD"]
        found.append(("parts", "op-amps {}, resistors {}, capacitors {}, diodes {}".format(*count)))
    about = f", estimated error {closed.error:.1e} of the largest displacement" if closed.engine == "ngspice" else ""
    return [*found, ("solved by", f"{closed.engine}{about}")]


def _length(value: float) -> str:
    return format_quantity(float(value), "m", 4)


def summary(closed: Closed) -> str:
    """Return the headline and the facts as lines."""
    return "\n".join([headline(closed), *(f"{name:<11} {value}" for name, value in facts(closed))])


def figure(closed: Closed) -> Figure:
    """Return reference and displacement, the error, the voltage over time."""
    figure, axes = new_figure(3, [1.8, 1.1, 1.3])
    for panel, draw in zip(axes, (_displacement, _error, _voltage), strict=True):
        draw(closed, panel)
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    heading(figure, headline(closed))
    return figure


def panels(closed: Closed) -> Panels:
    """Return the panels: displacement, error, voltage, current."""
    drawn = {"displacement": _displacement, "error": _error, "voltage": _voltage, "current": _current}
    return {name: partial(over_time, partial(draw, closed)) for name, draw in drawn.items()}


def _displacement(closed: Closed, panel: Axes, **style: Any) -> None:
    """Draw the displacement, the reference dashed, and what a noisy or late sensor measured as points."""
    factor = curve(panel, closed.time, closed.displacement, "displacement", "m", **{"label": "displacement"} | style)
    panel.plot(closed.time, factor * closed.reference, color=GREY, linestyle="--", linewidth=1.2, label="reference")
    waves = closed.waves
    if len(waves.sampled) and (closed.sensor.noise or closed.sensor.quantum or closed.sensor.delay):
        look: dict[str, Any] = {"color": ORANGE, "markersize": 2.0, "zorder": 1}
        panel.plot(waves.sampled, factor * waves.measured, ".", label="measured", **look)
    legend_above(panel)


def _error(closed: Closed, panel: Axes, **style: Any) -> None:
    curve(panel, closed.time, closed.reference - closed.displacement, "error", "m", **style)
    panel.axhline(0.0, color=GREY, linewidth=0.8)


def _voltage(closed: Closed, panel: Axes, **style: Any) -> None:
    held: dict[str, Any] = {"drawstyle": "steps-post"} if closed.period else {}
    curve(panel, closed.time, closed.voltage, "voltage", "V", **{"color": ORANGE} | held | style)
    for level in (-closed.limit, closed.limit):
        panel.axhline(level, color=GREY, linestyle=":", linewidth=1.0)


def _current(closed: Closed, panel: Axes, **style: Any) -> None:
    curve(panel, closed.time, closed.current, "current", "A", **style)
