"""Presents an actuator's description as text."""

from __future__ import annotations

import math
from typing import Any

from ..units import format_quantity


def summary(description: dict[str, Any]) -> str:
    """Return the description as text."""
    lines = [f"actuator {description['name']}, mounting {description['mounting']}"]
    for section in ("geometry", "material", "coupling"):
        if description[section] is None:
            lines += ["", f"{section}: not known (no displacement was measured)"]
            continue
        lines += ["", section]
        lines += [f"  {k:<26}{format_quantity(v['value'], v['unit'], 6)}" for k, v in description[section].items()]
    if "electrodes" in description:
        lines += ["", "electrodes"]
        for k, v in description["electrodes"].items():
            many = isinstance(v, dict) and isinstance(v["value"], list)
            values = v["value"] if many else [v["value"]] if isinstance(v, dict) else []
            shown = ", ".join(format_quantity(x, v["unit"], 6) for x in values) if values else v
            lines.append(f"  {k:<26}{shown}")
    if description["layers"]:
        lines += ["", "layers, from the anode's face on"]
        lines += [f"  {layer['name']:<26}{_values(layer)}" for layer in description["layers"]]
    lines += ["", "elements"]
    for name, entry in description["elements"].items():
        lines.append(f"  {name:<26}{format_quantity(entry['value'], entry['unit'], 6):<20}{entry['equation']}")
    low, high = (format_quantity(f, "Hz", 4) for f in description["band_Hz"])
    lines += ["", f"where the model holds, from {low} to {high}"]
    for row in description["holds"]:
        verdict = "holds" if row["holds"] else f"FAILS (limit {row['limit']:g}): {row['consequence']}"
        lines.append(f"  {row['assumption']:<58}{row['number']:<11.3g}{verdict}")
    return "\n".join([*lines, "", *_scaling(description), "", *_gravity(description["gravity"])])


def _values(layer: dict[str, Any]) -> str:
    """Return a layer's values in the order of its file, in one line."""
    shown = [format_quantity(v["value"], v["unit"], 4) for k, v in layer.items() if k != "name"]
    return ", ".join(shown)


def _scaling(description: dict[str, Any]) -> list[str]:
    """Return the exponents with the thickness by the laws of one layer and, where they are given, of the layers."""
    lines = ["exponents of the thickness b, at a voltage" + " " * 8 + "displacement  force   charge"]
    for row in description["scaling"]:
        what = f"{row['law']}, {row['varied']} varied"
        lines.append(f"  {what:<50}{row['displacement']:<14.2f}{row['force']:<8.2f}{row['charge']:.2f}")
    if len(description["scaling"]) == 1:
        lines.append("  give [[layers]] with capacitance_per_volume for the exponents of electrodes on a gel")
    return lines


def _gravity(gravity: dict[str, Any]) -> list[str]:
    """Return over which sizes gravity may be neglected."""
    lines = [f"where gravity may be neglected (r = m' g L0^3/(8 EI) <= {gravity['limit']:g})"]
    for row in gravity["sizes"]:
        longest, thinnest = (format_quantity(row[key], "m", 3) for key in ("longest", "thinnest"))
        text = f"r = {row['r']:<9.3g} free length up to {longest}, or thickness from {thinnest} in proportion"
        gel = row["thinnest_gel"]
        if gel is not None:
            text += ", or " + (
                "any gel" if gel == 0 else "no gel" if gel == math.inf else f"a gel from {format_quantity(gel, 'm', 3)}"
            )
        lines.append(f"  {row['law']:<20}{text}")
    return lines
