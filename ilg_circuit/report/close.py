"""Presents a closed loop over time: reference and displacement, error, voltage."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..units import format_quantity
from . import followed
from .axes import COLOURS, GREY, ORANGE, Axes, Figure, Panels, legend_above
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
    if (stage := closed.stage) and closed.ripple is not None:
        cycle = f"{format_quantity(stage.supply, 'V', 4)} at {format_quantity(stage.frequency, 'Hz', 4)}"
        ripple = f"ripple of the displacement up to {_length(closed.ripple)}"
        found.append(("pwm", f"{cycle} in {stage.steps} steps, {ripple}"))
    if closed.drift:
        ends = ", ".join(f"{name} to {end:.4g}" for name, end in closed.drift.items())
        found.append(("drift", f"{ends} of its start"))
    for name, values in closed.waves.estimates.items():
        found.append(("found", f"{name} {values[-1]:.4g} of its start, at the end"))
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
    return followed.figure(panels(closed), headline(closed))


def panels(closed: Closed) -> Panels:
    """Return the panels: displacement, error, voltage, current."""
    held = {"drawstyle": "steps-post"} if closed.period else {}
    wave = ("displacement", closed.displacement, "m")
    drawn = followed.panels(
        closed, wave, closed.reference, "reference", closed.limit, partial(_measured, closed), **held
    )
    if not closed.waves.estimates:
        return drawn
    return {**drawn, "estimates": partial(over_time, partial(_estimates, closed))}


def _estimates(closed: Closed, panel: Axes, **style: Any) -> None:
    """Draw what the controller found, of what it was at the start, and the drift dashed."""
    waves, shown = closed.waves, dict(zip(closed.waves.estimates, COLOURS, strict=False))
    for name, colour in shown.items():
        panel.plot(waves.sampled, waves.estimates[name], **{"color": colour, "label": name.replace("_", " ")} | style)
    for name, end in closed.drift.items():
        look: dict[str, Any] = {"color": shown.get(name, GREY), "linestyle": "--", "linewidth": 1.0}
        panel.plot([0.0, closed.time[-1]], [1.0, end], label=f"{name.replace('_', ' ')}, true", **look)
    panel.set_ylabel("of its start")
    legend_above(panel)


def _measured(closed: Closed, panel: Axes, factor: float) -> None:
    """Draw what a noisy or late sensor measured as points."""
    waves = closed.waves
    if len(waves.sampled) and (closed.sensor.noise or closed.sensor.quantum or closed.sensor.delay):
        look: dict[str, Any] = {"color": ORANGE, "markersize": 2.0, "zorder": 1}
        panel.plot(waves.sampled, factor * waves.measured, ".", label="measured", **look)
