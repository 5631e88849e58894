"""Finds implausible magnitudes, such as from a wrong unit in a header, and names the columns to check."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ..findings import Finding
from .film import Film
from .record import Record
from .spectrum import Spectrum

#: Limits of plausible resistance, capacitance and voltage of a strip [ohm, F, V].
_LEAST_RESISTANCE, _MOST_CAPACITANCE, _MOST_VOLTAGE = 1e-3, 1e4, 100.0
#: The same per area [ohm m2, F/m2, A/m2]: 1 mohm cm2, 20 F/cm2, 10 A/cm2.
_LEAST_AREAL_RESISTANCE, _MOST_AREAL_CAPACITANCE, _MOST_DENSITY = 1e-7, 2e5, 1e5
#: Limits per area: capacitance below a bare metal face's [F/m2], resistance above any gel's [ohm m2].
_LEAST_AREAL_CAPACITANCE, _MOST_AREAL_RESISTANCE = 1e-2, 1e5
#: Quantities of a port's fit, the likeliest to be in a wrong unit first.
_OF_THE_PORT = ("current", "voltage", "time", "re", "im", "frequency")


def proportion_findings(
    data: Sequence[Record | Spectrum | Film], port: tuple[float, float] | None, area: float, length: float
) -> list[Finding]:
    """Return findings on measured or fitted values that are implausible for the strip.

    Parameters
    ----------
    data
        The records, spectra and films that were fitted.
    port
        Resistance at high frequency [ohm] and total capacitance [F] of the port, if it was fitted; the capacitance is
        zero for a model without any.
    area, length
        Area and length of the strip [m2], [m].
    """
    found = [] if port is None else _of_the_port(data, *port, area)
    for record in (d for d in data if isinstance(d, Record | Film)):
        current = float(np.abs(record.current.values).max(initial=0.0)) if isinstance(record, Record) else 0.0
        if current > _MOST_DENSITY * area and not found:
            values = {"current": current, "area_cm2": area * 1e4, "columns": _columns([record], ("current",))}
            found.append(Finding("current-out-of-proportion", record.source, values))
        voltage = float(np.abs(record.drive.values).max(initial=0.0))
        if voltage > _MOST_VOLTAGE:
            values = {"voltage": voltage, "columns": _columns([record], ("voltage",))}
            found.append(Finding("voltage-out-of-proportion", record.source, values))
        if record.displacement is not None and len(record.displacement.values):
            span = float(np.ptp(record.displacement.values))
            if span > length:
                values = {"span": span, "length": length, "columns": _columns([record], ("displacement",))}
                found.append(Finding("displacement-out-of-proportion", record.source, values))
    return found


def _of_the_port(
    data: Sequence[Record | Spectrum | Film], resistance: float, capacitance: float, area: float
) -> list[Finding]:
    """Return the finding on a port that is implausible for a strip of an ``area`` [m2], if it is."""
    small = resistance < _LEAST_RESISTANCE or resistance * area < _LEAST_AREAL_RESISTANCE
    large = capacitance > _MOST_CAPACITANCE or capacitance > _MOST_AREAL_CAPACITANCE * area
    faint = 0 < capacitance < _LEAST_AREAL_CAPACITANCE * area or resistance * area > _MOST_AREAL_RESISTANCE
    if small or large or faint:
        values = {"resistance": resistance, "capacitance": capacitance, "columns": _columns(data, _OF_THE_PORT)}
        return [Finding("port-out-of-proportion", values={**values, "area_cm2": area * 1e4})]
    return []


def _columns(data: Iterable[Record | Spectrum | Film], quantities: Sequence[str]) -> list[str]:
    """Return the columns of some quantities with the units in their files; without columns the first quantity."""
    headers = [d.headers for d in data]
    named = [f"'{h[q][0]}' (unit {h[q][1]})" for q in quantities for h in headers if q in h]
    return list(dict.fromkeys(named)) or [f"the {quantities[0]}"]
