"""Fits the coupling d(s) to a displacement alone: the voltage is stated, and the port is not fitted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import InputError, argument
from ..findings import Finding
from ..measurements.film import Film
from ..strip.actuator import Actuator, Uncertainty
from ..strip.elements import lumped_elements, lumped_port
from ..strip.port import Port
from ..strip.specimen import Specimen
from .current import CurrentData
from .motion import NAMES


@dataclass(frozen=True)
class FilmData:
    """A film, as `displacement.fit_displacement` takes it: the drive is exact, only the clock's delay may be unknown.

    Readings later than ``until`` [s] after the onset are not fitted.
    """

    record: Film
    engine: str
    source: str
    until: float = math.inf

    share = 0.0
    late = 0.0
    places = ()

    @property
    def notes(self) -> tuple[Finding, ...]:
        return self.record.notes

    @property
    def drive(self) -> PiecewiseLinear:
        """The voltage since its onset."""
        return self.record.drive

    @property
    def abscissa(self) -> Array:
        return self.record.displacement.time

    @property
    def data(self) -> Array:
        return self.record.displacement.values

    @property
    def delay(self) -> float | Literal["fit"]:
        """Delay [s] of the displacement's clock relative to the drive's, if it was stated, else "fit"."""
        return "fit" if self.record.delay is None else self.record.delay

    @property
    def level(self) -> float | None:
        return self.record.step

    @property
    def voltage(self) -> float:
        """Largest voltage applied [V], with its sign."""
        values = self.drive.values
        return float(values[np.argmax(np.abs(values))])


#: One file with a displacement: beside a current, or alone.
Moving: TypeAlias = CurrentData | FilmData


def driven_strip(base: Actuator | Specimen | None, strip: Actuator, held: float | None) -> Actuator:
    """Return the filmed strip with its known circuit, which is not fitted.

    Without an electrode resistance [ohm], ``held`` or the strip's own, the voltage across the gel equals the drive for
    any circuit. Raises InputError for a strip with a resistance whose circuit is not known.
    """
    port = lumped_port(strip)
    resistance = port.electrode_resistance if held is None else held
    if resistance and isinstance(base, Specimen):
        raise InputError(
            f"{argument('electrode_resistance', f'{resistance:g}ohm')}: the voltage across the gel then depends on its "
            "circuit, which a displacement alone does not determine: give a strip with dc_resistivity, "
            "dynamic_resistivity and permittivity, or leave the resistance out"
        )
    if resistance == port.electrode_resistance:
        return strip
    if not (math.isfinite(resistance) and resistance >= 0):
        raise InputError(f"electrode resistance {resistance:g} ohm must be zero or more")
    made: Port = replace(lumped_elements(strip).port, electrode_resistance=resistance)
    how: dict[str, Any] = {
        "coupling": strip.coupling,
        "mounting": strip.mounting,
        "name": strip.name,
        "layers": strip.layers,
    }
    return Actuator.from_port(strip.geometry, made, base=strip.material, **how)


def require_films(model: str, own: Sequence[str], held: float | None) -> None:
    """Raise InputError for options that do not apply to displacements alone, such as an Re that is not ``held``."""
    if model != "auto":
        raise InputError(
            f"{argument('model', model)}: a displacement alone does not determine the circuit, which is taken "
            "from the strip; leave it out"
        )
    if held is None:
        raise InputError(
            f"{argument('electrode_resistance', 'fit')}: a displacement alone does not determine it; give it, or leave "
            "it out"
        )
    for name in own:
        if name not in NAMES:
            raise InputError(f"{argument('own', name)}: for displacements alone these may be own: {', '.join(NAMES)}")


def with_known(found: Uncertainty, before: Uncertainty | None) -> Uncertainty:
    """Return the covariance of a coupling, extended by the circuit's covariance ``before``, from another fit."""
    if before is None or before.model != found.model:
        return found
    kept = [k for k, name in enumerate(before.names) if name not in found.names]
    names = (*(before.names[k] for k in kept), *found.names)
    covariance = np.zeros((len(names), len(names)))
    covariance[: len(kept), : len(kept)] = np.array(before.covariance)[np.ix_(kept, kept)]
    covariance[len(kept) :, len(kept) :] = found.covariance
    return replace(found, names=names, covariance=tuple(map(tuple, covariance.tolist())))


def film_findings(base: Actuator | Specimen | None) -> list[Finding]:
    """Return the findings on a strip for which only a displacement was measured."""
    if base is None:
        return [Finding("no-actuator-film")]
    if isinstance(base, Specimen):
        modulus = base.stand_in().material.youngs_modulus
        assumed = [] if base.modulus_known else [Finding("modulus-assumed", values={"modulus": modulus})]
        return [Finding("circuit-not-measured"), *assumed]
    return [Finding("circuit-not-fitted")]
