"""The coupling d(s) from several records: one for all that have a displacement, rest position and drift own to each.

The port is that of the joint fit. Each record keeps what its own fit found: how long d(s) describes it, and whether it
drifts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import IlgError
from ..fit.residuals import independent_samples
from ..fit.together import Parameters, Part, Together, fit_together
from ..strip.actuator import Actuator, Coupling
from .datasets import CurrentData, Progress
from .displacement import NAMES, DisplacementFit, displacements, fit_displacement, moving_strip
from .joint_start import combined

Array = NDArray[np.float64]

_LEAST_SIGMA = 1e-9


@dataclass(frozen=True)
class JointDisplacement:
    """d(s) of several records: their own fits ``own``, and all ``together`` (None where only one has a displacement).

    ``sources`` are the records' names, ``voltages`` [V] the largest applied.
    """

    sources: tuple[str, ...]
    voltages: tuple[float, ...]
    own: tuple[DisplacementFit, ...]
    together: Together | None

    @property
    def beam(self) -> str:
        """The dynamic beam where any record by itself shows its inertia, else the static one."""
        return "dynamic" if any(fit.beam == "dynamic" for fit in self.own) else "static"

    @property
    def coupling(self) -> Coupling:
        """The joint one, the geometric mean of parameters that records have for themselves."""
        if self.together is None:
            return self.own[0].coupling
        return Coupling(*self.together.mean.tolist(), beam=self.beam)


def fit_displacements(
    records: Sequence[CurrentData],
    actuator: Actuator,
    engine: str,
    own_names: frozenset[str] = frozenset(),
    progress: Progress = None,
) -> tuple[JointDisplacement | None, list[str]]:
    """Fit d(s) to all records that have a displacement, and tell what is to be known of it.

    None where no displacement can be fitted. Raises SolveError where all together cannot.
    """
    fits: list[tuple[CurrentData, DisplacementFit]] = []
    told = []
    for record in records:
        if record.measurement.displacement is None:
            continue
        try:
            fits.append((record, fit_displacement(record.measurement, actuator, engine, progress)))
        except IlgError as error:
            told.append(f"{record.source}: no displacement fit: {error}")
    fits, against = _of_one_sign(fits)
    told += against
    if not fits:
        return None, told
    for record, fit in fits:
        told += [f"{record.source}: {line}" for line in fit.warnings if "axis" not in line and "residuals" not in line]
    if fits[0][1].sign < 0:
        told.append("the displacement falls as the voltage rises: its axis was taken to point away from the anode")
    own = tuple(fit for _, fit in fits)
    together = None
    if len(fits) > 1:
        beam = "dynamic" if any(fit.beam == "dynamic" for fit in own) else "static"
        strip = moving_strip(actuator, beam)
        parts = [_part(record, fit, strip, beam, engine) for record, fit in fits]
        limits = np.full(len(NAMES), np.inf)
        independent = [independent_samples(fit.fit.residuals) for fit in own]
        start = combined(NAMES, limits, [fit.fit for fit in own], independent)
        starts = np.tile(start, (len(parts), 1))
        together = fit_together(parts, Parameters(NAMES, limits, own_names), starts, progress)
    sources, voltages = tuple(r.source for r, _ in fits), tuple(r.voltage for r, _ in fits)
    return JointDisplacement(sources, voltages, own, together), told


def _of_one_sign(
    fits: list[tuple[CurrentData, DisplacementFit]],
) -> tuple[list[tuple[CurrentData, DisplacementFit]], list[str]]:
    """The records whose displacement follows the voltage in the direction of most, and a word on the others."""
    sign = 1.0 if sum(fit.sign for _, fit in fits) >= 0 else -1.0
    told = [
        f"{record.source}: its displacement moves against that of the others: was the camera's axis or the strip's "
        "polarity reversed? it was left out of the coupling"
        for record, fit in fits
        if fit.sign != sign
    ]
    return [pair for pair in fits if pair[1].sign == sign], told


def _part(record: CurrentData, own: DisplacementFit, strip: Actuator, beam: str, engine: str) -> Part:
    drive = record.measurement.drive
    channel = own.channel.until(own.window)
    t = channel.time

    def modelled(values: Array) -> Array:
        return own.sign * displacements(strip, drive, t, values, beam, engine)

    nuisance = np.column_stack([np.ones(len(t)), t])[:, : 1 + (own.drift is not None)]
    data = channel.values - own.rest  # a rest position far away would cost digits
    fit = own.fit
    spent = len(t) / max(len(t) - fit.count, 1)
    sigma = fit.rmse * float(np.sqrt(spent * len(t) / independent_samples(fit.residuals)))
    return Part(record.source, data, nuisance, modelled, max(sigma, _LEAST_SIGMA * float(np.ptp(data))))
