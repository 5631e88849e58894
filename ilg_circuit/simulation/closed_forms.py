"""The papers' closed forms, independent of every circuit and solver in this package and used to check them.

"EC (n)" are the equations of *Electromechanical Coupling Model for Ionic Liquid Gel Soft Actuators*, in the corrected
form. Times ``t`` are arrays [s] with the drive starting at t = 0; responses are zero for t < 0 and the right limit
at t = 0. Displacement is positive towards the anode (the opposite of EC's axis, as in EC (35)).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError

# -- current of the one-pole port, EC (1)-(5) --------------------------------------------------------------------------


def current_constants(
    dc_resistance: float, dynamic_resistance: float, capacitance: float, electrode_resistance: float = 0.0
) -> tuple[float, float, float]:
    """Return (a0/U [S], a1/U [S], lambda [1/s]) of the step current a0 + a1 exp(-lambda t), EC (4), (5) corrected."""
    series = dc_resistance + electrode_resistance
    d = dc_resistance * dynamic_resistance + electrode_resistance * (dc_resistance + dynamic_resistance)
    return 1 / series, dc_resistance**2 / (d * series), series / (d * capacitance)


def resistances_from_step(
    a0: float, a1: float, rate: float, voltage: float, electrode_resistance: float = 0.0
) -> tuple[float, float, float]:
    """Return (Rdc [ohm], Rd [ohm], C [F]) from a step's a0, a1 [A], lambda [1/s]: the inverse of EC (5), Re given.

    Four elements and three observables: Re must come from elsewhere, 0 <= Re < U/(a0 + a1), else InputError.
    """
    limit = voltage / (a0 + a1)
    if not 0 <= electrode_resistance < limit:
        raise InputError(f"electrode resistance {electrode_resistance:g} ohm: it must be from 0 to below {limit:g} ohm")
    dc = voltage / a0 - electrode_resistance
    x = limit - electrode_resistance
    dynamic = dc * x / (dc - x)
    d = dc * dynamic + electrode_resistance * (dc + dynamic)
    return dc, dynamic, (dc + electrode_resistance) / (rate * d)


def current_step(t: ArrayLike, a0: float, a1: float, rate: float) -> Array:
    """Return the step current a0 + a1 exp(-lambda t), EC (4)."""
    time = np.asarray(t, dtype=float)
    return np.where(time >= 0, a0 + a1 * np.exp(-rate * np.maximum(time, 0)), 0.0)


def current_ramp(t: ArrayLike, a0: float, a1: float, rate: float) -> Array:
    """Return current under a ramp of 1 V/s, the integral of `current_step`: a0 t + a1 (1 - exp(-lambda t))/lambda."""
    time = np.maximum(np.asarray(t, dtype=float), 0)
    return np.asarray(a0 * time - a1 * np.expm1(-rate * time) / rate)


def current_sine(t: ArrayLike, a0: float, a1: float, rate: float, frequency: float) -> Array:
    """Return the current under sin(2 pi f t) from t = 0: phasor of EC (2) and the transient from rest."""
    time = np.maximum(np.asarray(t, dtype=float), 0)
    s = 2j * np.pi * frequency
    response = a0 + a1 * s / (s + rate)
    return np.asarray(np.imag(response * np.exp(s * time)) - response.imag * np.exp(-rate * time))


def voltage_constants(
    dc_resistance: float, dynamic_resistance: float, capacitance: float, electrode_resistance: float = 0.0
) -> tuple[float, float, float]:
    """Return (a0/I [ohm], a1/I [ohm], lambda [1/s]) of a current step's voltage a0 + a1 exp(-lambda t), EC (27).

    a0 = Rdc + Re, a1 = (Rdc parallel Rd) - Rdc, lambda = 1/((Rdc + Rd) C); the ``current_`` forms take them.
    """
    series = dc_resistance + dynamic_resistance
    return dc_resistance + electrode_resistance, -(dc_resistance**2) / series, 1 / (series * capacitance)


# -- displacement of the free, massless strip, EC (31)-(34) ------------------------------------------------------------


def _modes(t: Array, damping_ratio: float, natural_frequency: float) -> tuple[Array, Array]:
    """Return c = e^(-sigma t) cos(wd t), S = e^(-sigma t) sin(wd t)/wd, also at and above critical damping."""
    sigma = damping_ratio * natural_frequency
    square = sigma**2 - natural_frequency**2
    root = np.sqrt(abs(square))
    if square > 0:
        fast, slow = np.exp(-(sigma + root) * t), np.exp(-(natural_frequency**2 / (sigma + root)) * t)
        return (slow + fast) / 2, -slow * np.expm1(-2 * root * t) / (2 * root)
    decay = np.exp(-sigma * t)
    return decay * np.cos(root * t), decay * t * np.sinc(root * t / np.pi)


def displacement_step(
    t: ArrayLike, gain: float, zero: float, damping_ratio: float, natural_frequency: float, bending_ratio: float
) -> Array:
    """Return the free displacement per volt of step [m/V], EC (34) with the sign of EC (35), for any damping ratio.

    ``bending_ratio`` = 3 L_F^2/b^2. For zeta' < 1 this is EC (34); at and above 1 the sine and cosine become their
    critical and hyperbolic limits.
    """
    time = np.maximum(np.asarray(t, dtype=float), 0)
    static = bending_ratio * gain * zero / natural_frequency**2
    c, s = _modes(time, damping_ratio, natural_frequency)
    return np.asarray(static * (1 - c - (damping_ratio * natural_frequency - natural_frequency**2 / zero) * s))


def displacement_ramp(
    t: ArrayLike, gain: float, zero: float, damping_ratio: float, natural_frequency: float, bending_ratio: float
) -> Array:
    """Return the free displacement [m] under 1 V/s: the integral of `displacement_step`."""
    time = np.maximum(np.asarray(t, dtype=float), 0)
    static = bending_ratio * gain * zero / natural_frequency**2
    sigma = damping_ratio * natural_frequency
    c, s = _modes(time, damping_ratio, natural_frequency)
    integral_s = (1 - c - sigma * s) / natural_frequency**2
    return np.asarray(static * (time - s - (2 * sigma - natural_frequency**2 / zero) * integral_s))


def displacement_sine(
    t: ArrayLike,
    gain: float,
    zero: float,
    damping_ratio: float,
    natural_frequency: float,
    bending_ratio: float,
    frequency: float,
) -> Array:
    """Return the free displacement per volt [m/V] under sin(2 pi f t) switched on at t = 0, from rest; EC (32)."""
    time = np.maximum(np.asarray(t, dtype=float), 0)
    s = 2j * np.pi * frequency
    sigma = damping_ratio * natural_frequency
    response = bending_ratio * gain * (s + zero) / (s**2 + 2 * sigma * s + natural_frequency**2)
    c, decay = _modes(time, damping_ratio, natural_frequency)
    start, slope = -response.imag, -(response * s).imag
    return np.asarray(np.imag(response * np.exp(s * time)) + start * c + (slope + sigma * start) * decay)


# -- displacement under a current: y/i = -(N/s) Rdc/(Rdc + Zp), d(s) after the voltage a0 + a1 exp(-lambda t) ---------


def moved_step(
    t: ArrayLike,
    gain: float,
    zero: float,
    damping_ratio: float,
    natural_frequency: float,
    bending_ratio: float,
    a0: float,
    a1: float,
    rate: float,
) -> Array:
    """Return the free displacement [m/A] under a step of current, whose voltage across the gel has these constants."""
    time = np.maximum(np.asarray(t, dtype=float), 0)
    constants = (gain, zero, damping_ratio, natural_frequency, bending_ratio)
    at_pole, slope = _relaxing(*constants, rate)
    sigma = damping_ratio * natural_frequency
    c, s = _modes(time, damping_ratio, natural_frequency)
    relaxing = at_pole * np.exp(-rate * time) - at_pole * (c - sigma * s) + slope * s
    return np.asarray(a0 * displacement_step(time, *constants) + a1 * relaxing)


def moved_ramp(
    t: ArrayLike,
    gain: float,
    zero: float,
    damping_ratio: float,
    natural_frequency: float,
    bending_ratio: float,
    a0: float,
    a1: float,
    rate: float,
) -> Array:
    """Return the free displacement [m] under a current of 1 A/s: the integral of `moved_step`."""
    time = np.maximum(np.asarray(t, dtype=float), 0)
    constants = (gain, zero, damping_ratio, natural_frequency, bending_ratio)
    at_pole, slope = _relaxing(*constants, rate)
    c, s = _modes(time, damping_ratio, natural_frequency)
    integral_s = (1 - c - damping_ratio * natural_frequency * s) / natural_frequency**2
    relaxing = -at_pole * np.expm1(-rate * time) / rate - at_pole * s + slope * integral_s
    return np.asarray(a0 * displacement_ramp(time, *constants) + a1 * relaxing)


def _relaxing(
    gain: float, zero: float, damping_ratio: float, natural_frequency: float, bending_ratio: float, rate: float
) -> tuple[float, float]:
    """Return D and B of the answer D e^(-lambda t) + (B - D s)/(s^2 + 2 zeta' wn' s + wn'^2) to e^(-lambda t)."""
    damping = 2 * damping_ratio * natural_frequency
    at_pole = bending_ratio * gain * (zero - rate) / (rate**2 - damping * rate + natural_frequency**2)
    return at_pole, bending_ratio * gain - damping * at_pole + rate * at_pole


def steady_displacement(voltage: float, static_coupling: float, load_distance: float, thickness: float) -> float:
    """Return the free displacement at rest [m], EC (37): 3 U L_F^2 d0/b^2."""
    return 3 * voltage * load_distance**2 * static_coupling / thickness**2


def steady_force(
    voltage: float, static_coupling: float, youngs_modulus: float, width: float, thickness: float, load_distance: float
) -> float:
    """Return the clamped force at rest [N], EC (26), (39) corrected: (3/4) d0 E U b w/L_F."""
    return 3 / 4 * static_coupling * youngs_modulus * voltage * thickness * width / load_distance
