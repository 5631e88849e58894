"""Presents the frequencies to which a rhythm with a reflex locks."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..oscillators.entrainment import Entrainment
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, legend_above, new_figure


def summary(found: Entrainment) -> str:
    """Return the range, and phase or drift at every frequency as a table."""
    lines = [headline(found), *(f"{name:<16}{value}" for name, value in facts(found)), ""]
    lines.append(
        f"{'input [Hz]':<12}{'locked':<8}{'drift [turns]':>14}{'output lag':>12}{'angle lag':>11}{'angle [rad]':>13}"
    )
    for row in found.to_dict()["rows"]:
        lags = ("" if row[k] is None else f"{row[k]:.1f}" for k in ("output_lag_deg", "angle_lag_deg"))
        output, angle = lags
        locked, drift = ("yes", "") if row["locked"] else ("no", f"{row['drift_turns']:.4f}")
        lines.append(
            f"{row['frequency_Hz']:<12.5g}{locked:<8}{drift:>14}{output:>12}{angle:>11}{row['angle_rad']:>13.4g}"
        )
    return "\n".join(lines)


def headline(found: Entrainment) -> str:
    """Return one line: the amplitude of the input and the gain of the reflex."""
    return f"input of amplitude {found.amplitude:g} into a rhythm with reflex {found.rhythm.loop.gain:g} /rad"


def facts(found: Entrainment) -> list[tuple[str, str]]:
    """Return the rhythm's own frequency and the range to which it locks."""
    own = found.own
    rows = [("own frequency", f"{own:.5g} Hz (period {1 / own:.5g} s)")]
    if found.low <= found.high:
        parts = f"{found.low / own:.4f} to {found.high / own:.4f} times its own"
        rows.append(("locks from", f"{found.low:.5g} to {found.high:.5g} Hz ({parts})"))
    else:
        rows.append(("locks", "not at its own frequency"))
    return rows


def figure(found: Entrainment) -> Figure:
    """Return phase lags within the range, shaded, and the drift outside it, over the input's frequency."""
    figure, (upper, lower) = new_figure(2, [2.0, 1.5])
    _lags(found, upper)
    upper.set_xlabel("")
    _drift(found, lower)
    figure.align_ylabels([upper, lower])
    return figure


def panels(found: Entrainment) -> Panels:
    """Return the panels: phase lags and drift."""
    return {"lags": partial(_lags, found), "drift": partial(_drift, found)}


def _lags(found: Entrainment, panel: Axes, **style: Any) -> Axes:
    """Draw the lags, which go on beyond 180 degrees."""
    for values, name, colour, line in (
        (found.output_lag, "output", BLUE, "-"),
        (found.angle_lag, "angle", ORANGE, "--"),
    ):
        known = found.locked & np.isfinite(values)
        lags = np.degrees(np.unwrap(np.radians(values[known])))
        look: dict[str, Any] = {
            "color": colour,
            "linestyle": line,
            "marker": "o",
            "markersize": 3,
            "linewidth": 1.4,
            "label": name,
        }
        panel.plot(found.frequency[known], lags, **look | style)
    panel.set_ylabel("lag behind the input [degrees]")
    _framed(found, panel)
    legend_above(panel)
    return panel


def _drift(found: Entrainment, panel: Axes, **style: Any) -> Axes:
    look: dict[str, Any] = {"color": BLUE, "marker": "o", "markersize": 3, "linewidth": 1.4} | style
    panel.plot(found.frequency, found.drift, **look)
    panel.set_ylabel("drift [turns a period]")
    return _framed(found, panel)


def _framed(found: Entrainment, panel: Axes) -> Axes:
    if found.low <= found.high:
        panel.axvspan(found.low, found.high, color=GREY, alpha=0.12, linewidth=0, label="locked")
    panel.axvline(found.own, color=GREY, linewidth=0.8, linestyle=":", label="own frequency")
    panel.set(xlabel="frequency of the input [Hz]", xlim=(found.frequency.min(), found.frequency.max()))
    return panel
