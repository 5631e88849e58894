"""What can be moved in a window, where a slider stands, and which value that is.

The sliders are those of a strip's page, and beside them those of its layers and of the sheets of its electrodes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from ..browser.sliders import Slider, shown_unit, sliders
from ..strip.actuator import Actuator
from ..strip.changes import STRIP_PARAMETERS, layer_parameter
from ..strip.layers import LAYER_FIELDS
from ..units import parse

#: A slider's places go from minus this to this; in the middle is the strip's own value.
ENDS = 100


#: A slider of a layer or a sheet goes from the strip's value divided by this to that times it.
_ENDS = 4.0
#: What the layers of a strip make, and is not moved itself.
_OF_LAYERS = ("thickness", "youngs_modulus", "density")
#: What is moved of sheets of electrodes.
_OF_SHEETS = ("sheet_resistance_1", "sheet_resistance_2", "lead_resistance")


def movable(strip: Actuator) -> list[Slider]:
    """Return the sliders of a strip.

    >>> from ..strip.actuator import PAPER
    >>> [each.name for each in movable(PAPER)][:4]
    ['length', 'free_length', 'width', 'thickness']
    """
    found = [each for each in sliders(strip) if not (strip.layers and each.name in _OF_LAYERS)]
    for layer in {each.name: each for each in strip.layers}.values():
        for name, about in LAYER_FIELDS.items():
            if value := getattr(layer, name):
                words = name.replace("_", " ").replace("youngs", "Young's")
                found.append(_slider(f"{layer.name}_{name}", f"{layer.name}: {words}", "Layers", about["unit"], value))
    sheets = {} if strip.electrodes is None else {name: getattr(strip.electrodes, name) for name in _OF_SHEETS}
    return found + [
        _slider(name, name.replace("_", " ").capitalize(), "Electrodes", "ohm", value)
        for name, value in sheets.items()
        if value
    ]


def _slider(name: str, label: str, group: str, si: str, value: float) -> Slider:
    unit, scale = shown_unit(value, si)
    return Slider(name, label, label, group, unit, scale, value, value / _ENDS, value * _ENDS)


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
    known = next((p for p in STRIP_PARAMETERS if p.name == key(slider)), None) or layer_parameter(slider.name)
    return parse(plain, known.unit if known else "", slider.label)


def key(slider: Slider) -> str:
    """Return the name by which `Actuator.with_` takes a slider's value."""
    return slider.name.removeprefix("coupling_")


def changes(sliders: Iterable[Slider], values: Mapping[str, float]) -> dict[str, float]:
    """Return the values that differ from the strip's own, by the names that `Actuator.with_` takes."""
    return {key(s): values[s.name] for s in sliders if values.get(s.name, s.value) != s.value}
