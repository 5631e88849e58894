"""Computes the standard errors of a prediction: the fit's covariance carried through the circuit, to first order.

Each fitted parameter is moved up and down by a small factor and all circuits are solved together. With the slopes S of
the waveforms with respect to the parameters' logarithms and their covariance C, the variance is S C S^T. What the model
left of the fit's records, by the time since a jump of the drive and per volt, is added to it: misfit is no noise, and
the next record shows it, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Array
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..circuit.wiring import Wiring
from ..drive import Drive, PiecewiseLinear, Sine, by_current
from ..errors import InputError, argument
from ..solve.transient import transient
from ..strip.actuator import Actuator, quantities
from ..strip.elements import lumped_port
from ..strip.models import electrical_model
from ..strip.uncertainty import Residuals
from .response import line_of, transient_band
from .waveforms import WAVEFORMS

#: Step of the central differences, in parts of a parameter; far above the solve's error, far below any nonlinearity.
_STEP = 1e-3
_ACCURACY = 1e-8
#: Logarithm of time over which a misfit is alike, and samples computed at a time.
_ALIKE, _AT_ONCE = np.log(10), 20_000


@dataclass(frozen=True)
class Band:
    """Standard errors (n,) of a response's waveforms at ``time`` [s] (n,), by the names of `Response`'s fields."""

    time: Array
    stderr: dict[str, Array]


def prediction_band(
    actuator: Actuator,
    drive: Drive,
    times: Array,
    *,
    tip: str = "free",
    beam: str | None = None,
    load: Load | None = None,
    engine: str = "ngspice",
    wires: Wiring | None = None,
    misfit: bool = True,
    sums: Mapping[str, Mapping[str, float]] | None = None,
) -> Band:
    """Return the band for `ilg_circuit.simulation.response.simulate` with the same arguments.

    ``sums`` are further waveforms by name, each the circuit's outputs with their weights. The band holds the ``misfit``
    of the fit's records, too, where the strip knows it, for a voltage and a free tip. Raises InputError where the
    actuator brings no covariance (it was not fitted), or one whose names it does not have.
    """
    uncertainty = actuator.uncertainty
    if uncertainty is None:
        raise InputError(
            f"actuator '{actuator.name}' has no [uncertainty]: fit one with identify, or leave {argument('band')} out"
        )
    ladders = transient_band(times)
    line, _ = line_of(actuator, ladders, wires, drive.largest())
    how: dict[str, Any] = {"tip": tip, "beam": beam, "load": load, "band": ladders, **line}
    moved = [
        strip_netlist(scaled(actuator, {name: np.exp(sign * _STEP)}, ladders), by_current=by_current(drive), **how)
        for sign in (1.0, -1.0)
        for name in uncertainty.names
    ]
    accuracy = _ACCURACY if moved[0].linear else 1e-6
    waveforms = transient(moved, drive, times, engine=engine, accuracy=accuracy, acceptable=1e-5)
    up, down = np.split(waveforms.values, 2)
    slopes = (up - down) / (2 * _STEP)
    covariance = np.array(uncertainty.covariance)
    place = {name: k for k, name in enumerate(waveforms.names)}
    further = [sum(w * slopes[:, place[name]] for name, w in of.items()) for of in (sums or {}).values()]
    if further:
        slopes = np.concatenate([slopes, np.stack(further, axis=1)], axis=1)
    variance = np.einsum("pot,pq,qot->ot", slopes, covariance, slopes)
    errors = dict(zip((*waveforms.names, *(sums or ())), np.sqrt(np.clip(variance, 0.0, None)), strict=True))
    if (
        misfit
        and tip == "free"
        and wires is None
        and not by_current(drive)
        and isinstance(drive, PiecewiseLinear | Sine)
    ):
        for left in uncertainty.residuals:
            if left.quantity in errors:
                errors[left.quantity] = np.hypot(errors[left.quantity], misfit_of(left, drive, waveforms.times))
    kept = {*WAVEFORMS, *(sums or ())}
    return Band(waveforms.times, {name: error for name, error in errors.items() if name in kept})


def misfit_of(left: Residuals, drive: PiecewiseLinear | Sine, times: Array) -> Array:
    """Return the standard deviation (n,) of the misfit under a ``drive`` at ``times`` [s] (n,).

    It is the larger of two, which the fit's record does not tell apart. A linear system's error adds up over what the
    drive did before: its answer to a step of 1 V is a random function of the time since, of the deviations that the fit
    left, alike within a decade of time, but steps of opposite sign are not taken to cancel. A drift goes with the
    time since the onset, and the largest voltage; of a drive without jumps it is at least that of all times.
    """
    known, ratio = np.array(left.times), np.sqrt(10)
    further = int(np.ceil(np.log(max(float(times[-1]) / known[-1], 1.0)) / np.log(ratio)))
    ages = np.concatenate([[0.0], known, known[-1] * ratio ** np.arange(1, further + 1)])
    logarithm, deviations = np.log(np.maximum(ages, known[0])), left.at(ages)
    alike = np.exp(-(((logarithm[:, None] - logarithm) / _ALIKE) ** 2) / 2) * np.outer(deviations, deviations)
    parts = np.array_split(times, len(times) // _AT_ONCE + 1)
    shares = [_shares(drive, part, ages) for part in parts]
    signed = [[np.maximum(sign * share, 0.0) for sign in (1, -1)] for share in shares]
    linear = np.concatenate([sum(((s @ alike) * s).sum(axis=1) for s in both) for both in signed])
    jumps = drive.value(0.0) != drive.rest or len(drive.jumps(float(times[-1])))
    drift = left.at(times) if jumps else np.maximum(left.at(times), left.rms)
    return np.asarray(np.maximum(np.sqrt(linear), drive.largest() * drift))


def _shares(drive: PiecewiseLinear | Sine, times: Array, ages: Array) -> Array:
    """Return by how much [V] the answer to a step counts at ``times`` (n,), at each of ``ages`` (a,) of the step.

    Between two ages it is a straight line, so that the mean voltage there tells.
    """
    past = _integral(drive, times[:, None] - ages)
    means = (past[:, :-1] - past[:, 1:]) / np.diff(ages)
    first, last = (drive.value(times) - drive.rest)[:, None], np.zeros((len(times), 1))
    return -np.diff(np.hstack([first, means, last]), axis=1)


def _integral(drive: PiecewiseLinear | Sine, t: Array) -> Array:
    """Return the integral [V s] of a drive above its rest from 0 to ``t`` [s], zero before."""
    t = np.maximum(t, 0.0)
    if isinstance(drive, Sine):
        return np.asarray(drive.amplitude / drive.angular_frequency() * (1 - np.cos(drive.angular_frequency() * t)))
    knots = np.append(0.0, drive.times[drive.times > 0])
    # both values at a jump: on its left, and on its right, where the piece begins
    right = np.append(drive.value(0.0), drive.values[drive.times > 0]) - drive.rest
    whole = np.append(0.0, np.cumsum(np.diff(knots) * (right[1:] + right[:-1]) / 2))
    k = np.searchsorted(knots, t, side="right") - 1
    return np.asarray(whole[k] + (t - knots[k]) * (right[k] + drive.value(t) - drive.rest) / 2)


def scaled(actuator: Actuator, factors: dict[str, float], band: tuple[float, float]) -> Actuator:
    """Return the actuator with fitted parameters multiplied by ``factors``; ``band`` [Hz] is for a ladder."""
    uncertainty = actuator.uncertainty
    assert uncertainty is not None
    model = electrical_model(uncertainty.model)
    port = lumped_port(actuator, band)
    values = model.values(port)
    coupling = actuator.coupling
    # fields of the coupling by the names that fits use
    own = {} if coupling is None else {f"coupling_{q.name}": q for q in quantities(coupling)}
    known = {*model.names, "electrode_resistance", *own}
    for name in factors:
        if name not in known:
            raise InputError(f"uncertainty names '{name}', which model {model.name} of this actuator has not")
    changed = [value * factors.get(name, 1.0) for name, value in zip(model.names, values, strict=True)]
    if coupling is not None:
        coupling = replace(coupling, **{q.name: q.value * factors.get(name, 1.0) for name, q in own.items()})
    made = model.port(changed, port.electrode_resistance * factors.get("electrode_resistance", 1.0))
    material = Actuator.from_port(actuator.geometry, made, base=actuator.material).material
    if port.ladder is not None:  # one topology for all: as many sections as the nominal strip's, over the same band
        low, high = port.ladder.band
        sections = float(len(port.ladder.sections))
        material = replace(material, ladder_lowest=low, ladder_highest=high, ladder_sections=sections)
    return replace(actuator, material=material, coupling=coupling, uncertainty=None)
