"""Presents an actuator's description as text."""

from __future__ import annotations

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
    lines += ["", "elements"]
    for name, entry in description["elements"].items():
        lines.append(f"  {name:<26}{format_quantity(entry['value'], entry['unit'], 6):<20}{entry['equation']}")
    low, high = (format_quantity(f, "Hz", 4) for f in description["band_Hz"])
    lines += ["", f"where the model holds, from {low} to {high}"]
    for row in description["holds"]:
        verdict = "holds" if row["holds"] else f"FAILS (limit {row['limit']:g}): {row['consequence']}"
        lines.append(f"  {row['assumption']:<58}{row['number']:<11.3g}{verdict}")
    return "\n".join(lines)
