"""A PI controller for the position of a strip's tip: chosen for its margins, and what these are."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, ComplexArray
from ..circuit.strip import strip_netlist
from ..control.margins import MOST_SENSITIVE, crossings
from ..solve.spectrum import spectrum
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements
from ..units import format_quantity

#: The step of the set-point asks at first for so many times the largest voltage, at most.
_BOLDEST = 2.0
#: The least gain that is tried in parts of the boldest, and the damping of a beam that has none.
_LEAST, _DAMPING = 1e-8, 1e-6
#: Frequencies at which the loop is judged, from and to in parts of that of d(s).
_FROM, _TO, _POINTS = 1e-3, 1e4, 1401


@dataclass(frozen=True)
class Loop:
    """A PI controller ``gain`` (1 + 1/(``reset`` s)), gain in V/mm and reset in seconds, and the loop's margins.

    ``crossover`` [Hz] is where the loop gain is 1, ``phase_margin`` is in degrees there; ``sensitivity`` is the
    largest of abs(1/(1 + L)). ``reference`` [mm] is the step of its set-point, ``limit`` [V] that of its output.
    """

    gain: float
    reset: float
    crossover: float
    phase_margin: float
    sensitivity: float
    reference: float
    limit: float

    @property
    def text(self) -> str:
        """The margin in words."""
        if math.isnan(self.phase_margin):
            return "no crossover, since the beam rings: a beam_damping_ratio of the strip allows more gain"
        return f"margin {self.phase_margin:.1f} degrees at {format_quantity(self.crossover, 'Hz', 4)}"


def pi_loop(actuator: Actuator, limit: float, reference: float, beam: str | None = None) -> Loop:
    """Return the boldest PI controller of a strip with a free tip that keeps the sensitivity.

    Its reset time is the slower one of d(s), its gain the largest below which no gain takes the sensitivity above
    `MOST_SENSITIVE`, or a set-point of ``reference`` [mm] the output above twice the ``limit`` [V].
    """
    coupling = actuator.coupling
    assert coupling is not None
    reset = rounded(coupling.time)
    frequency = _frequencies(actuator)
    plant = position_per_volt(_damped(actuator), frequency, beam)
    shape = plant * (1 + 1 / (2j * np.pi * frequency * reset))
    boldest = _BOLDEST * limit / reference
    gain = _LEAST * boldest
    for part in np.geomspace(_LEAST, 1.0, 400):  # from below: the first that is not stable ends it
        if not _good(np.asarray(part * boldest * shape, dtype=complex)):
            break
        gain = part * boldest
    gain = rounded(gain, down=True)
    loop = np.asarray(gain * shape, dtype=complex)
    at, margin = margins(frequency, loop)
    return Loop(gain, reset, at, margin, _sensitivity(loop), reference, limit)


def position_per_volt(actuator: Actuator, frequency: Array, beam: str | None = None) -> ComplexArray:
    """Return the small-signal position [mm/V] (f,) of a free tip about rest, at ``frequency`` [Hz] (f,)."""
    return 1e3 * spectrum(strip_netlist(actuator, beam=beam), frequency, engine="exact").output("displacement")


def margins(frequency: Array, loop: ComplexArray) -> tuple[float, float]:
    """Return the highest frequency [Hz] at which the gain of ``loop`` falls through 1, and the margin [degrees] there.

    A loop that never does has its lowest frequency and no margin that is a number.
    """
    at, angle, falls = crossings(frequency, loop)
    if not falls.any():
        return float(frequency[0]), math.nan
    margin = np.degrees(angle[falls][-1]) + 180
    return float(at[falls][-1]), float((margin + 180) % 360 - 180)


def _frequencies(actuator: Actuator) -> Array:
    """Return frequencies [Hz] (f,) at which a loop is judged, close together about the beam's resonance."""
    lumped, coupling = lumped_elements(actuator), actuator.coupling
    assert coupling is not None
    wide = np.geomspace(_FROM, _TO, _POINTS) * coupling.rate
    aside = np.geomspace(1e-2 * _DAMPING, 0.3, 300)
    resonance = np.sqrt((lumped.stiffness + lumped.gravity) / lumped.mass) * np.concatenate([1 - aside, [1], 1 + aside])
    return np.union1d(wide, resonance) / (2 * np.pi)


def _damped(actuator: Actuator) -> Actuator:
    """Return the strip with a little damping where it has none, which no frequency could tell from instability."""
    damping = max(actuator.material.beam_damping_ratio, _DAMPING)
    return replace(actuator, material=replace(actuator.material, beam_damping_ratio=damping))


def _good(loop: ComplexArray) -> bool:
    """Return whether a loop is stable, by Nyquist's criterion, and not too sensitive."""
    phase = np.angle(1 + loop)
    turned = np.unwrap(phase)
    encircles = abs((turned[-1] - turned[0]) - (phase[-1] - phase[0])) > np.pi
    return not encircles and _sensitivity(loop) <= MOST_SENSITIVE


def _sensitivity(loop: ComplexArray) -> float:
    return float((1 / np.abs(1 + loop)).max())


def rounded(value: float, digits: int = 2, *, down: bool = False) -> float:
    """Return a positive number with ``digits`` digits, as one would write it."""
    place = digits - 1 - math.floor(math.log10(value))
    scaled = value * 10.0**place
    return float(f"{(math.floor(scaled) if down else round(scaled)) * 10.0**-place:.{digits}g}")
