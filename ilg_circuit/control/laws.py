"""Controllers: each is one linear law whose output is limited, and what the limit takes off is fed back.

    x' = A x + b_r r + b_y y + b_s (u - v),    v = c x + d_r r + d_y y,    u = v within the limit

for the reference r [m], the measured displacement y [m] and the voltage u [V].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, solve_continuous_are

from ..arrays import Array, ComplexArray
from ..errors import InputError, argument, unknown_name, wrong_choice
from .plant import Plant

#: How the integrator is kept from winding up.
ANTI_WINDUP = ("back-calculation", "clamping", "none")
#: Filter of a PID's derivative: its time constant in parts of the derivative time.
_FILTER = 10.0
#: Bandwidth of an extended state observer, in parts of that of the loop.
OBSERVER = 5.0


@dataclass(frozen=True, eq=False)
class Law:
    """A controller of a ``kind`` with the ``gains`` that made it, by name [SI units], as a linear law.

    a (n, n); into_reference, into_measured, into_excess, out (n,). With ``clamps`` the first state, the integral [V],
    stays within the limit of the voltage.
    """

    kind: str
    gains: Mapping[str, float]
    a: Array
    into_reference: Array
    into_measured: Array
    into_excess: Array
    out: Array
    reference: float = 0.0
    measured: float = 0.0
    clamps: bool = False

    def response(self, frequency: Array) -> ComplexArray:
        """Return -v/y [V/m] at angular frequencies [rad/s] (f,), the controller's part of the loop gain."""
        matrix = 1j * frequency[:, None, None] * np.eye(len(self.a)) - self.a
        right = np.broadcast_to(self.into_measured[:, None], (*matrix.shape[:2], 1)).astype(complex)
        return np.asarray(-(np.linalg.solve(matrix, right)[..., 0] @ self.out) - self.measured)

    def guarded(self, how: str, tracking: float | None = None) -> Law:
        """Return the law with another anti-windup; ``tracking`` [s] is the time constant of back-calculation.

        Raises InputError for an unknown word, or for clamping a law that is not PI or PID.
        """
        if how not in ANTI_WINDUP:
            raise wrong_choice(argument("anti_windup"), how, ANTI_WINDUP)
        if self.kind not in ("pi", "pid") and (how == "clamping" or tracking is not None):
            raise InputError(f"{argument('anti_windup', how)} is for pi and pid; the observer of {self.kind} has u")
        if how == "back-calculation":
            if tracking is None:
                return self
            if not tracking > 0:
                raise InputError(f"{argument('tracking_time')} is {tracking:g} s; it must be more than zero")
            excess = np.zeros_like(self.into_excess)
            excess[0] = 1 / tracking
            return replace(self, into_excess=excess, gains={**self.gains, "tracking_time": tracking})
        return replace(self, into_excess=np.zeros_like(self.into_excess), clamps=how == "clamping")


def pi(plant: Plant, gain: float, reset_time: float, weight: float = 1.0) -> Law:
    """Return v = gain (weight r - y) + I, I' = gain/reset_time (r - y) + (u - v)/reset_time."""
    rate = gain / reset_time
    return Law(
        "pi",
        {"gain": gain, "reset_time": reset_time, "weight": weight},
        a=np.zeros((1, 1)),
        into_reference=np.array([rate]),
        into_measured=np.array([-rate]),
        into_excess=np.array([1 / reset_time]),
        out=np.ones(1),
        reference=gain * weight,
        measured=-gain,
    )


def pid(plant: Plant, gain: float, reset_time: float, derivative_time: float, weight: float = 1.0) -> Law:
    """Return the PI law less gain derivative_time dy/dt, which a filter of derivative_time/10 follows."""
    rate, filter_time = gain / reset_time, derivative_time / _FILTER
    kick = gain * derivative_time / filter_time
    return Law(
        "pid",
        {"gain": gain, "reset_time": reset_time, "derivative_time": derivative_time, "weight": weight},
        a=np.diag([0.0, -1 / filter_time]),
        into_reference=np.array([rate, 0.0]),
        into_measured=np.array([-rate, 1 / filter_time]),
        into_excess=np.array([1 / np.sqrt(reset_time * derivative_time), 0.0]),
        out=np.array([1.0, kick]),
        reference=gain * weight,
        measured=-gain - kick,
    )


def lqg(plant: Plant, speed: float, observer: float, integral: float) -> Law:
    """Return a linear-quadratic regulator behind a Kalman filter that also estimates a constant voltage error.

    v = (r - what the state calls for) - error, so that the loop has integral action. The regulator's cost is
    y^2 + (b0 u/speed^n)^2, n the relative degree: ``speed`` [rad/s] is how fast it answers. The filter's noise is
    white: voltage of density (observer^n/b0)^2, its error's rate of integral^2 times that, and 1 of y; ``observer`` and
    ``integral`` [rad/s] are how fast it trusts the measurement. Raises InputError without a solution.
    """
    n, (degree, leading) = len(plant.b), plant.leading()
    cost, noise = (leading / speed**degree) ** 2, (observer**degree / leading) ** 2
    a, c = np.zeros((n + 1, n + 1)), np.append(plant.c, 0.0)
    a[:n, :n], a[:n, n] = plant.a, plant.b
    b = np.append(plant.b, 0.0)
    spread = np.outer(b, b) * noise
    spread[n, n] = noise * integral**2
    try:
        k = plant.b @ solve_continuous_are(plant.a, plant.b[:, None], np.outer(plant.c, plant.c), [[cost]]) / cost
        gain = solve_continuous_are(a.T, c[:, None], spread, np.ones((1, 1))) @ c
    except (LinAlgError, ValueError):
        raise InputError(f"no LQG has speed {speed:g}, observer {observer:g}, integral {integral:g} rad/s") from None
    steady = -np.linalg.solve(plant.a, plant.b)  # the state at rest under 1 V
    ahead = (1 + k @ steady) / plant.gain
    out = -np.append(k, 1.0)
    return Law(
        "lqg",
        {"speed": speed, "observer": observer, "integral": integral},
        a=a - np.outer(gain, c) + np.outer(b, out),
        into_reference=b * ahead,
        into_measured=gain,
        into_excess=b,
        out=out,
        reference=float(ahead),
    )


def adrc(plant: Plant, bandwidth: float, observer: float = OBSERVER) -> Law:
    """Return linear active disturbance rejection: the plant as y^(n) = b0 u + f, f estimated by an observer.

    All poles of the loop are at ``bandwidth`` [rad/s], those of the observer at ``observer`` times it.
    """
    degree, b0 = plant.leading()
    n = degree + 1
    chain = np.diag(np.ones(degree), 1)
    poly: Array = np.asarray(np.poly(np.full(n, -observer * bandwidth))[1:], dtype=float)
    into = np.zeros(n)
    into[degree - 1] = b0
    k = np.poly(np.full(degree, -bandwidth))[1:][::-1] / b0  # of y, y', ...
    out = -np.append(k, 1 / b0)
    a = chain - np.outer(poly, np.eye(n)[0]) + np.outer(into, out)
    return Law(
        "adrc",
        {"bandwidth": bandwidth, "observer": observer, "b0": b0},
        a=a,
        into_reference=into * k[0],
        into_measured=poly,
        into_excess=into,
        out=out,
        reference=float(k[0]),
    )


@dataclass(frozen=True)
class Kind:
    """A kind of controller: its maker, and the units of the gains that are searched, by name."""

    make: Callable[..., Law]
    units: Mapping[str, str]
    optional: Mapping[str, float] = field(default_factory=dict)


KINDS: dict[str, Kind] = {
    "pi": Kind(pi, {"gain": "V/m", "reset_time": "s", "weight": ""}, {"weight": 1.0}),
    "pid": Kind(pid, {"gain": "V/m", "reset_time": "s", "derivative_time": "s", "weight": ""}, {"weight": 1.0}),
    "lqg": Kind(lqg, {"speed": "rad/s", "observer": "rad/s", "integral": "rad/s"}),
    "adrc": Kind(adrc, {"bandwidth": "rad/s", "observer": ""}, {"observer": OBSERVER}),
}


def kind_of(name: str) -> Kind:
    """Return a kind of controller by its name. Raises InputError for another one."""
    if name not in KINDS:
        raise wrong_choice(argument("kind"), name, KINDS)
    return KINDS[name]


def law_of(name: str, plant: Plant, gains: Mapping[str, Any]) -> Law:
    """Return the law of a kind with ``gains`` [SI]. Raises InputError for an unknown or missing gain, or a bad one."""
    kind = kind_of(name)
    for gain in gains:
        if gain not in kind.units:
            raise unknown_name(f"gain of {name}", gain, kind.units)
    missing = [gain for gain in kind.units if gain not in gains and gain not in kind.optional]
    if missing:
        raise InputError(f"{argument('gains')}: {name} needs {', '.join(missing)} too")
    for gain, value in gains.items():
        if not (np.isfinite(value) and (value > 0 or (gain == "weight" and value == 0))):
            raise InputError(f"{argument('gains')}: {gain} is {value:g}; it must be more than zero")
    return kind.make(plant, **gains)
