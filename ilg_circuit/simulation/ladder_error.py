"""Estimates the error of a strip's ladder, in the waveforms of a run, against the element that it approximates.

A ladder with twice the number of sections over a band two decades wider at both ends is solved too, near 0 V and
without the beam's inertia, as sums of modes. The difference is the error, apart from the finer ladder's own, which is a
small part of it. A fractional coupling's ladder states its own error, over the band.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..drive import Drive, PiecewiseLinear, by_current
from ..solve.exact import modal_output
from ..solve.state_space import state_space
from ..strip.actuator import Actuator
from ..strip.couplings import RelaxingCoupling
from ..strip.elements import lumped_port
from ..strip.ladder import MOST_SECTIONS

#: Factor that allows for the finer ladder's own error.
_CAUTION = 1.5
_WIDER = 100.0
#: Largest value of samples, relative to the run's, below which they are rounding about zero.
_FELT = 1e-3
#: Lines per period that approximate a sine, and the largest number of periods; later ones repeat.
_CHORDS, _PERIODS = 40, 25
#: Largest numbers of points after each edge of the drive, and of samples, that are compared.
_AFTER_EDGE, _SAMPLES = 24, 400


def ladder_error(
    actuator: Actuator, drive: Drive, times: Array, waveforms: Mapping[str, Array], band: tuple[float, float]
) -> float:
    """Return the error of the worst of current, charge, displacement and energy, relative to its largest value.

    ``band`` [Hz] is that of the ladder where the strip gives none; 0 for a strip without one.
    """
    coupling = actuator.coupling
    bending = coupling.ladder(actuator.material.ladder_band(band)) if isinstance(coupling, RelaxingCoupling) else None
    own = bending.error if bending is not None and times[-1] else 0.0
    return max(own, _port_error(actuator, drive, times, waveforms, band))


def _port_error(
    actuator: Actuator, drive: Drive, times: Array, waveforms: Mapping[str, Array], band: tuple[float, float]
) -> float:
    """Return `ladder_error` of the ion path's ladder."""
    ladder = lumped_port(actuator, band).ladder
    if ladder is None or not times[-1]:
        return 0.0
    low, high = ladder.band
    finer = replace(
        actuator.material,
        ladder_lowest=low / _WIDER,
        ladder_highest=high * _WIDER,
        ladder_sections=float(min(2 * len(ladder.sections), MOST_SECTIONS)),
    )
    lines, points, seen = _points(drive, times)
    systems = [
        state_space([strip_netlist(strip, beam="static", band=band, by_current=by_current(drive)).linearised()])
        for strip in (actuator, replace(actuator, material=finer))
    ]
    source, worst = lines.value(points), 0.0
    answer = "voltage" if by_current(drive) else "current"
    for name in {answer, "charge", "displacement"} & set(systems[0].output_names):
        own, fine = (modal_output(system, name, lines, points)[0] for system in systems)
        compared = {name: (own, fine - own)}
        if name == answer:
            compared["energy"] = (_work(points, source * own), _work(points, source * (fine - own)))
        for waveform, (values, difference) in compared.items():
            sampled, largest = (float(np.abs(x).max()) for x in (np.nan_to_num(waveforms[waveform]), values[seen]))
            scale = max(sampled, _FELT * largest)  # samples may lie beside the peaks of a sine
            error = float(np.abs(difference[seen]).max())
            worst = max(worst, error / scale if scale else 0.0)
    return _CAUTION * worst


def _points(drive: Drive, times: Array) -> tuple[Drive, Array, NDArray[np.intp]]:
    """Return the drive by straight lines, ascending times at which to compare, and where some samples are in them."""
    omega, end = drive.angular_frequency(), float(times[-1])
    if omega:
        end = min(end, _PERIODS * 2 * np.pi / omega)
        corners = np.linspace(0.0, end, 2 + int(_CHORDS * end * omega / (2 * np.pi)))
        drive = PiecewiseLinear(corners, drive.value(corners))
        times = np.union1d(times[times <= end], corners)
    seen = times if len(times) <= _SAMPLES else np.union1d(times[: _SAMPLES // 2], times[:: len(times) // _SAMPLES])
    edges = np.concatenate([[0.0], drive.breakpoints(end)])
    after = np.append(0.0, np.geomspace(1e-7, 1.0, _AFTER_EDGE, endpoint=False)) if not omega else np.zeros(1)
    points = np.union1d((edges[:, None] + np.diff(np.append(edges, end))[:, None] * after).ravel(), seen)
    return drive, points, np.searchsorted(points, seen)


def _work(times: Array, power: Array) -> Array:
    """Return the integral (t,) of a power by the trapezoidal rule."""
    return np.append(0.0, np.cumsum(np.diff(times) * (power[1:] + power[:-1]) / 2))
