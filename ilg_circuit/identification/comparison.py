"""Compares a prediction with a measurement: the model's response to a record's drive, and the recorded response."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from ..circuit.load import Load
from ..drive import PiecewiseLinear
from ..errors import InputError, argument
from ..findings import Finding
from ..fit.criteria import effective_samples
from ..measurements.record import Channel, Record
from ..measurements.smoothing import noise_level
from ..simulation.compared import Compared
from ..simulation.prediction_band import prediction_band
from ..simulation.response import simulate
from ..strip.actuator import Actuator
from .jumps import by_jumps

#: Accuracy of responses with jumps elsewhere.
_MOVED = 1e-5
#: Probability of a band, and below which a record outside it is named.
_BAND, _CHANCE = 0.95, 0.01


def compare(
    actuator: Actuator,
    measurement: Record,
    *,
    until: float = np.inf,
    band: bool = False,
    tip: str = "free",
    beam: str | None = None,
    load: Load | None = None,
    engine: str = "ngspice",
) -> tuple[Compared, ...]:
    """Return current and displacement of a record and their predictions, up to ``until`` [s] in the file's time.

    The voltage is processed as in a fit: jumps lie between readings, levels are averaged. A ``band`` includes that the
    places of jumps are unknown. Of a record whose current was controlled that is the drive, and the voltage is
    compared. Raises InputError if the record begins after ``until``, and the errors of `simulate` and
    `prediction_band`.
    """
    forced, drive = measurement.forced, measurement.drive
    channels = {"current": measurement.current}
    if forced is not None:
        channels, drive = {"voltage": forced.voltage}, forced.drive.drive
    if measurement.displacement is not None and tip == "free" and actuator.coupling is not None:
        channels["displacement"] = measurement.displacement
    parts = {name: _after(channel, until - channel.zero) for name, channel in channels.items()}
    parts = {name: part for name, part in parts.items() if len(part.time)}
    if not parts:
        raise InputError(
            f"{measurement.source}: its excitation begins at {measurement.onset:g} s, the run ends at {until:g} s; "
            f"choose a longer {argument('duration')}"
        )
    # the onset is the run's beginning, where the strip is at rest
    times = np.unique(np.concatenate([[0.0], *(part.time for part in parts.values())]))
    response = simulate(actuator, drive, times, tip=tip, beam=beam, load=load, engine=engine)
    errors = {}
    if band:
        errors = prediction_band(actuator, drive, times, tip=tip, beam=beam, load=load, engine=engine).stderr
        known = measurement.voltage if forced is None else forced.drive

        def predict(other: PiecewiseLinear, at: Array) -> dict[str, Array]:
            moved = simulate(actuator, other, at, tip=tip, beam=beam, load=load, engine=engine, accuracy=_MOVED)
            return {name: getattr(moved, name) for name in parts}

        width = next(iter(parts.values())).width
        for name, more in by_jumps(known, width, times, predict).items():
            errors[name] = np.hypot(errors[name], more)
    found = []
    for name, part in parts.items():
        at = np.searchsorted(times, part.time)
        predicted = getattr(response, name)[at]
        measured, turned, offset = part.values, False, False
        if name == "displacement":
            measured, turned, offset = _positions(channels[name], part, predicted)
        found.append(
            Compared(
                source=measurement.source,
                quantity=name,
                time=part.time + part.zero,
                measured=measured,
                predicted=predicted,
                stderr=errors[name][at] if name in errors else None,
                noise=noise_level(part.values),
                reversed_axis=turned,
                offset=offset,
            )
        )
    return tuple(part for part in found if part.largest > 0)


def outside_findings(parts: Sequence[Compared]) -> tuple[Finding, ...]:
    """Return a finding on each record that lies outside the prediction's 95 % band more often than chance explains."""
    from scipy.stats import binom

    found = []
    for part in parts:
        if part.covered is None:
            continue
        samples = int(effective_samples(part.measured - part.predicted))
        if part.covered < float(binom.ppf(_CHANCE, samples, _BAND)) / samples:
            values = {"quantity": part.quantity, "outside": 1 - part.covered, "allowed": 1 - _BAND}
            found.append(Finding("record-outside-band", part.source, values))
    return tuple(found)


def _after(channel: Channel, end: float) -> Channel:
    return channel.without(channel.rest | (channel.time > end))


def _positions(channel: Channel, part: Channel, predicted: Array) -> tuple[Array, bool, bool]:
    """Return displacements from rest, positive to the anode; True if the axis was reversed; True if rest is unknown."""
    known = bool(channel.rest.any())
    turned = float(np.cov(part.values, predicted)[0, 1]) < 0 if len(predicted) > 1 else False
    values = -part.values if turned else part.values
    if known:
        rest = float(np.median(channel.values[channel.rest]))
        return values - (-rest if turned else rest), turned, False
    return values - float(np.mean(values - predicted)), turned, True
