"""The validity of the model: every assumption of the two papers as a number, over the band of frequencies in use."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..drive import by_current, voltage_limit
from .actuator import Actuator
from .couplings import RelaxingCoupling
from .elements import gravity_ratio, lumped_elements

if TYPE_CHECKING:
    from ..drive import Drive

#: Electrochemical window [V] of the paper's liquid, BMIMBF4, about.
ELECTROCHEMICAL_WINDOW = 4.0
#: Deflection over L_F up to which the small-deflection beam holds.
LARGEST_DEFLECTION = 0.2
#: Thickness over free length up to which a beam is slender.
LARGEST_SLENDERNESS = 0.1


@dataclass(frozen=True)
class Assumption:
    """One assumption: its number, the largest number at which it counts as holding, and what follows if it fails."""

    name: str
    number: float
    limit: float
    consequence: str
    harmless: bool = False  # under a voltage, or as the strip is mounted: told by `show`, no run warns of it

    @property
    def holds(self) -> bool:
        return self.number <= self.limit

    def warning(self) -> str:
        return f"{self.name}: {self.number:.3g} exceeds {self.limit:g}; {self.consequence}"


def assumptions(
    actuator: Actuator,
    *,
    band: tuple[float, float] = (1e-4, 10.0),
    voltage: float | None = None,
    displacement: float | None = None,
) -> Iterator[Assumption]:
    """Return the table for use between ``band`` [Hz], up to ``voltage`` [V] and ``displacement`` [m] where known."""
    lumped, g = lumped_elements(actuator, band), actuator.geometry
    s = 2j * np.pi * np.geomspace(*band, 400)
    ion = np.array([lumped.ion_impedance(x) for x in s])
    if lumped.coupling is not None:
        n = np.array([lumped.coupling_factor(x) for x in s])
        compliance, inertia = lumped.stiffness / s, lumped.mass * s + lumped.damping
        clamped = np.abs(n**2 * compliance / ion).max()
        free = np.abs(n**2 * compliance * inertia / ((compliance + inertia) * ion)).max()
        consequence = "the motion acts back on the current: use the dynamic beam, not EC (26)-(29)"
        yield Assumption("reflected impedance over Zp, EC (20), (21)", float(max(clamped, free)), 1e-2, consequence)
    consequence = "EC (24), (27) per current do not hold at the low end of the band; harmless under voltage drive"
    over = float(np.abs(ion / lumped.port.dc_resistance).max())
    yield Assumption("abs(Zp/Rdc), EC (23)", over, 0.1, consequence, harmless=True)
    if displacement is not None:
        bent = abs(displacement) / g.load_distance
        consequence = "the small-deflection beam overstates the tip's path"
        yield Assumption("deflection y/L_F", bent, LARGEST_DEFLECTION, consequence)
    consequence = "not slender: shear and clamp matter"
    yield Assumption("thickness over free length b/L0", g.thickness / g.free_length, LARGEST_SLENDERNESS, consequence)
    yield gravity(actuator)
    for row in actuator.material.model.ions.assumptions(lumped.port, band):
        yield Assumption(*row)
    if isinstance(actuator.coupling, RelaxingCoupling):
        ladder = actuator.coupling.ladder(actuator.material.ladder_band(band))
        if ladder is not None:
            consequence = "a narrower band, by ladder_lowest and ladder_highest, needed"
            yield Assumption("fractional coupling ladder's error", ladder.error, 0.01, consequence)
    if voltage is not None:
        name = "abs(u) over the electrochemical window of 4 V (BMIMBF4)"
        consequence = "the liquid decomposes: a linear circuit says nothing about that"
        yield Assumption(name, abs(voltage) / ELECTROCHEMICAL_WINDOW, 1.0, consequence)


def gravity(actuator: Actuator) -> Assumption:
    """Return gravity's number, for any L_F: sag/L0 of a horizontal strip, else r; harmless for a weightless one."""
    ratio, orientation = gravity_ratio(actuator), actuator.mounting.orientation
    if orientation == "horizontal":
        return Assumption("gravity, horizontal: sag/L0", ratio, 0.2, "the strip sags beyond small deflection")
    consequence = "so soft a strip bends far from the linear beam that is computed here: ask the command arm"
    if orientation == "weightless":
        what = "E" if actuator.material.bending_stiffness is None and not actuator.layers else "EI"
        consequence = (
            f"{what} alone cannot hold the strip against gravity; the fitted coupling has gravity in it, so it holds "
            "for this mounting and size only"
        )
    name = "gravity, hanging: r = rho_m w b g L0^3/(8 EI)"
    return Assumption(name, ratio, 1.0, consequence, harmless=orientation == "weightless")


def largest_voltage(actuator: Actuator, drive: Drive) -> float:
    """Return the largest voltage [V] of a run: the drive's, or a bound of what a current makes, its limit at most."""
    if not by_current(drive):
        return drive.largest()
    port = lumped_elements(actuator).port
    # the step response rises to Re + Rdc, so nothing that a current does is beyond
    inner = drive.largest() * port.dc_resistance
    if port.emission_voltage is not None:
        inner = port.emission_voltage * math.asinh(drive.largest() / port.saturation_current)
    limit = voltage_limit(drive)
    return min(inner + drive.largest() * port.electrode_resistance, math.inf if limit is None else limit)


def run_warnings(
    actuator: Actuator, drive: Drive, duration: float, voltage: float, displacement: float | None
) -> list[str]:
    """Return the assumptions that fail in a run of ``duration`` [s] up to ``voltage`` [V] and ``displacement`` [m]."""
    end = duration or 1.0
    band = (1 / (2 * np.pi * end), max(drive.angular_frequency() / (2 * np.pi), 100 / end))
    rows = assumptions(actuator, band=band, voltage=voltage, displacement=displacement)
    return [row.warning() for row in rows if not row.holds and not row.harmless]


def deflection_warnings(bent: int) -> list[str]:
    """Return the warning for ``bent`` designs, of several, beyond the small-deflection limit."""
    if not bent:
        return []
    designs = "1 design has" if bent == 1 else f"{bent} designs have"
    where = "where the small-deflection beam overstates the tip's path"
    return [f"{designs} a relative_deflection beyond {LARGEST_DEFLECTION:g}, {where}"]
