"""Where a slider stands and which value that is; the sliders themselves are those of a strip's page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from ..browser.sliders import Slider
from ..strip.changes import STRIP_PARAMETERS
from ..units import parse

#: A slider's places go from minus this to this; in the middle is the strip's own value.
ENDS = 100


def value_at(slider: Slider, place: float) -> float:
    """Return the SI value of a slider at a place; the middle is exactly its own.

    >>> from ..strip.actuator import PAPER
    >>> from ..browser.sliders import sliders
    >>> thickness = next(s for s in sliders(PAPER) if s.name == "thickness")
    >>> [round(1e3 * value_at(thickness, place), 3) for place in (-100, 0, 100)]
    [0.125, 0.5, 2.0]
    """
    if place == 0:
        return slider.value
    end = slider.highest if place > 0 else slider.lowest
    share = abs(place) / ENDS
    if slider.even or slider.value * end <= 0:
        return slider.value + share * (end - slider.value)
    return slider.value * (end / slider.value) ** share


def place_of(slider: Slider, value: float) -> int:
    """Return the place of a value, an end for one beyond it."""
    low, high = sorted((slider.lowest, slider.highest))
    value = min(max(value, low), high)
    above = (value > slider.value) == (slider.highest > slider.lowest)
    end = slider.highest if above else slider.lowest
    if value == slider.value or end == slider.value:
        return 0
    if slider.even or slider.value * end <= 0:
        share = (value - slider.value) / (end - slider.value)
    else:
        share = math.log(value / slider.value) / math.log(end / slider.value)
    return round(ENDS * share) if above else -round(ENDS * share)


def shown(slider: Slider, value: float) -> str:
    """Return a value in the slider's unit."""
    return f"{value / slider.scale:.4g} {slider.unit}".strip()


def typed(slider: Slider, text: str) -> float:
    """Return the SI value of what was typed, in the slider's unit if none was. Raises InputError."""
    plain = text.strip().replace("\N{NO-BREAK SPACE}", " ")
    try:
        return float(plain.replace(",", ".")) * slider.scale
    except ValueError:
        pass
    if slider.unit and plain.endswith(slider.unit.replace("\N{NO-BREAK SPACE}", " ")):
        number = plain[: -len(slider.unit)].strip()
        try:
            return float(number.replace(",", ".")) * slider.scale
        except ValueError:
            pass
    unit = next((p.unit for p in STRIP_PARAMETERS if p.name == key(slider)), "")
    return parse(plain, unit, slider.label)


def key(slider: Slider) -> str:
    """Return the name by which `Actuator.with_` takes a slider's value."""
    return slider.name.removeprefix("coupling_")


def changes(sliders: Iterable[Slider], values: Mapping[str, float]) -> dict[str, float]:
    """Return the values that differ from the strip's own, by the names that `Actuator.with_` takes."""
    return {key(s): values[s.name] for s in sliders if values.get(s.name, s.value) != s.value}
