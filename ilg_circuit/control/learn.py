"""Learns the voltage for a path over repeated trials, and says first for which samples of a fit that converges.

u_(k+1) = Q (u_k + L e_k) with the voltage u (n,) at nodes of a trial from rest and the error e = r - G u (2n - 1,) at
nodes and half way between them. Q keeps the cosines up to a bandwidth, without shifting phase; L is a gain times the
nominal strip's inverse within them. All are matrices over the whole trial: error and contraction have closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import solve_triangular

from ..arrays import Array, Mask, plain
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..drive import Drive, PiecewiseLinear, drive_findings
from ..errors import InputError, argument
from ..findings import Finding, Warned
from ..result import Column, Result
from ..simulation.response import transient_band
from ..solve.state_space import state_space
from ..strip.actuator import Actuator
from .plant import plants_of, sampled
from .programme import Limits, answers, trapezoid
from .track import Voltage, require_path
from .tune import draws_of

#: Trials after the first, nodes of the voltage, gain of the learning.
TRIALS, NODES, GAIN = 10, 201, 1.0
_MOST_TRIALS = 1000
#: Highest frequency that nodes carry, in parts of the one that is learnt by default.
_FINER = 2.5


@dataclass(frozen=True, eq=False)
class Trial:
    """A trial that was measured: ``voltage`` [V] and ``displacement`` [m] (n,) over ``time`` [s] from its start."""

    time: Array
    voltage: Array
    displacement: Array


@dataclass(frozen=True, eq=False)
class Rule:
    """The learning rule over ``nodes`` [s] (n,): the cosines that Q keeps (n, k), L (k, 2n - 1), weights of errors.

    ``root`` (2n - 1,) are the roots of the weights with which a sum of squares is the mean over time.
    """

    nodes: Array
    cosines: Array
    inverse: Array
    root: Array

    def next(self, voltage: Array, error: Array, limit: float) -> Array:
        """Return the voltage (n,) of the next trial, within the limit, from voltage and error of the last one."""
        asked = self.cosines @ (self.cosines.T @ voltage + self.inverse @ error)
        return np.asarray(np.clip(asked, -limit, limit))

    def contraction(self, answer: Array) -> float:
        """Return the factor by which the error's distance from its limit falls each trial, at the least [rms].

        ``answer`` [m/V] (2n - 1, n) is the true strip's. It is the 2-norm of G Q (1 - L G) G^-1 on the errors that
        voltages within the bandwidth make.
        """
        heard = answer @ self.cosines
        upper = np.linalg.qr(self.root[:, None] * heard).R
        left = upper @ (np.eye(len(upper)) - self.inverse @ heard)
        return float(np.linalg.norm(solve_triangular(upper.T, left.T, lower=True), 2))

    def limit(self, answer: Array, path: Array) -> Array:
        """Return the error [m] (2n - 1,) at which learning ends: r (1 - Q)/(1 - Q (1 - L P)) of the true strip."""
        heard = answer @ self.cosines
        voltage = np.linalg.solve(self.inverse @ heard, self.inverse @ path)
        return np.asarray(path - heard @ voltage)

    def size(self, error: Array) -> float:
        """Return the root mean square of an error over time [m]."""
        return float(np.linalg.norm(self.root * error))


def learning_rule(answer: Array, nodes: Array, bandwidth: float, gain: float = GAIN) -> Rule:
    """Return the rule for a nominal strip with ``answer`` [m/V] (2n - 1, n), which learns up to ``bandwidth`` [Hz]."""
    n, duration = len(nodes), float(nodes[-1])
    count = min(1 + int(2 * duration * bandwidth * (1 + 1e-9)), n)
    cosines = np.cos(np.pi * (np.arange(n)[:, None] + 0.5) * np.arange(count) / n)
    cosines /= np.linalg.norm(cosines, axis=0)
    root: Array = np.sqrt(trapezoid(2 * n - 1) / (2 * n - 2))
    inverse = gain * np.linalg.pinv(root[:, None] * (answer @ cosines)) * root
    return Rule(nodes, cosines, np.asarray(inverse, dtype=float), root)


@dataclass(frozen=True, repr=False, eq=False)
class Learned(Voltage, Warned, Result):
    """Errors of a path over repeated trials, as `ilg_circuit.learn` returns it; row 0 of samples is the nominal strip.

    Attributes
    ----------
    actuator : Actuator
        The strip as it was fitted, which the learning inverts.
    path : ndarray (m,)
        Where the tip shall be [m] at ``time`` [s] (m,).
    voltage_limit, bandwidth, gain : float
        Limit of the voltage [V], highest frequency that is learnt [Hz], gain of the learning.
    contraction : ndarray (samples,)
        Factor by which the error's distance from its limit falls each trial, at the least; 1 or more promises nothing.
    limits : ndarray (samples,)
        Error at which learning ends [m, rms]; NaN where nothing is promised.
    errors, distances : ndarray (samples, trials)
        Error of each trial, and its distance from the limit's [m, rms]; the first trial's voltage is the nominal
        strip's inverse.
    limited : ndarray (samples,)
        Whether a trial met the limit of the voltage.
    worst : int
        The sample with the largest first error.
    displacements : ndarray (2, m)
        Displacement [m] of that sample in the first trial and the last.
    voltages : ndarray (2, n)
        Its voltage [V] at the nodes of ``drive``.
    drive : PiecewiseLinear
        The voltage for the next trial: the first one, or that after the trial that was measured.
    trial_error : float or None
        Error of the measured trial [m, rms].
    findings : tuple of Finding
        What the learning should be known for.
    """

    presenter: ClassVar[str] = "learn"
    actuator: Actuator
    path_text: str
    path: Array
    time: Array
    voltage_limit: float
    bandwidth: float
    gain: float
    contraction: Array
    limits: Array
    errors: Array
    distances: Array
    limited: Mask
    worst: int
    displacements: Array
    voltages: Array
    drive: PiecewiseLinear
    trial_error: float | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def promised(self) -> Mask:
        """For which samples (samples,) the contraction is promised: below 1, and no trial met the voltage's limit."""
        return np.asarray((self.contraction < 1) & ~self.limited)

    @property
    def bounds(self) -> Array:
        """Largest error [m, rms] of each trial (trials,) that is promised; NaN if nothing is."""
        good = self.promised
        if not good.any():
            return np.full(self.errors.shape[1], np.nan)
        falls = self.contraction[good, None] ** np.arange(self.errors.shape[1])
        return np.asarray((self.limits[good, None] + falls * self.distances[good, :1]).max(axis=0))

    def table(self) -> tuple[Column, ...]:
        """Return the trials' numbers, errors of the nominal strip, the median and worst sample, and the bound."""
        return (
            Column("trial", np.arange(self.errors.shape[1]), "", over=True),
            Column("error_nominal", self.errors[0], "m"),
            Column("error_median", np.median(self.errors, axis=0), "m"),
            Column("error_largest", self.errors.max(axis=0), "m"),
            Column("error_promised", self.bounds, "m"),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return contraction, limits and errors of all samples, and the next voltage, as plain data."""
        return {
            "actuator": self.actuator.name,
            "path": self.path_text,
            "voltage_limit": self.voltage_limit,
            "bandwidth": self.bandwidth,
            "gain": self.gain,
            "samples": len(self.contraction) - 1,
            "promised": int(self.promised.sum()),
            "contraction": plain(self.contraction),
            "limit_rms": [value if np.isfinite(value) else None for value in self.limits.tolist()],
            "limited": self.limited.tolist(),
            "error_rms": self.errors.tolist(),
            "trial_error_rms": self.trial_error,
            "next_voltage": {"time_s": plain(self.drive.times), "voltage_V": plain(self.drive.values)},
            "findings": [finding.to_dict() for finding in self.findings],
        }


def learn(
    actuator: Actuator,
    path: Drive,
    duration: float,
    *,
    trials: int = TRIALS,
    limit: float = 4.0,
    bandwidth: float | None = None,
    gain: float = GAIN,
    nodes: int = NODES,
    trial: Trial | None = None,
    beam: str | None = None,
    load: Load | None = None,
    draws: int | None = None,
    seed: int = 0,
) -> Learned:
    """Return the errors of ``trials`` trials after the first, for samples of a fit's covariance as true strips.

    ``bandwidth`` [Hz] is a fifth of the nodes a second by default. Raises InputError for values out of range, or a
    strip with a nonlinear circuit.
    """
    require_path(Limits(limit), nodes, duration)
    if not 1 <= trials <= _MOST_TRIALS:
        raise InputError(f"{argument('trials')} is {trials}; give 1 to {_MOST_TRIALS}")
    if not 0 < gain < 2:
        raise InputError(f"{argument('gain')} is {gain:g}; give more than 0 and less than 2, such as 0.5")
    most = (nodes - 1) / duration / 2
    bandwidth = most / _FINER if bandwidth is None else bandwidth
    if not 0 < bandwidth <= most * (1 + 1e-9):
        raise InputError(
            f"{argument('bandwidth')} is {bandwidth:g} Hz; {nodes} nodes in {duration:g} s carry up to {most:.4g} Hz"
        )
    at, fine = np.linspace(0.0, duration, nodes), np.linspace(0.0, duration, 2 * nodes - 1)
    wanted = path.value(fine)
    plant = plants_of(actuator, beam=beam, load=load)[0]
    if not actuator.material.model.linear:
        raise InputError(f"actuator '{actuator.name}' is nonlinear; what learning promises is for linear strips")
    strips = [actuator, *sampled(actuator, draws_of(actuator, draws), seed)]
    band = transient_band(fine)

    def answer_of(strip: Actuator) -> Array:
        return answers(state_space([strip_netlist(strip, beam=beam, load=load, band=band)]), at).output

    rule = learning_rule(answer_of(actuator), at, bandwidth, gain)
    first = rule.next(np.zeros(nodes), wanted / gain, limit)
    runs = [_run(rule, answer_of(strip), wanted, first, limit, trials) for strip in strips]
    errors = np.array([run.errors for run in runs])
    worst = int(np.argmax(errors[:, 0]))
    following = first
    if trial is not None:
        missed = wanted - np.interp(fine, trial.time, trial.displacement)
        following = rule.next(np.interp(at, trial.time, trial.voltage), missed, limit)
    learned = Learned(
        actuator=actuator,
        path_text=path.text,
        path=wanted,
        time=fine,
        voltage_limit=limit,
        bandwidth=bandwidth,
        gain=gain,
        contraction=np.array([run.contraction for run in runs]),
        limits=np.array([run.limit for run in runs]),
        errors=errors,
        distances=np.array([run.distances for run in runs]),
        limited=np.array([run.limited for run in runs]),
        worst=worst,
        displacements=wanted - runs[worst].ends,
        voltages=runs[worst].voltages,
        drive=PiecewiseLinear(at, following, f"voltage for {path.text}"),
        trial_error=None if trial is None else rule.size(missed),
    )
    return replace(learned, findings=(*drive_findings(path), *_findings(learned, abs(plant.gain) * limit)))


@dataclass(frozen=True, eq=False)
class _Run:
    contraction: float
    limit: float
    errors: list[float]
    distances: list[float]
    limited: bool
    ends: Array
    voltages: Array


def _run(rule: Rule, answer: Array, path: Array, voltage: Array, limit: float, trials: int) -> _Run:
    """Return the trials of a strip with an ``answer``."""
    contraction = rule.contraction(answer)
    last = rule.limit(answer, path) if contraction < 1 else np.full(len(path), np.nan)
    errors, voltages = [path - answer @ voltage], [voltage]
    for _ in range(trials):
        voltages.append(rule.next(voltages[-1], errors[-1], limit))
        errors.append(path - answer @ voltages[-1])
    return _Run(
        contraction,
        rule.size(last),
        [rule.size(error) for error in errors],
        [rule.size(error - last) for error in errors],
        bool(np.abs(voltages).max() >= limit),
        np.array([errors[0], errors[-1]]),
        np.array([voltages[0], voltages[-1]]),
    )


def _findings(learned: Learned, reach: float) -> tuple[Finding, ...]:
    """Return what the learning should be known for; ``reach`` [m] is what the limit of the voltage holds."""
    found = []
    size, samples = float(np.abs(learned.path).max()), len(learned.contraction)
    if size > reach:
        found.append(
            Finding(
                "path-too-far", values={"unit": "m", "size": size, "reach": reach, "voltage": learned.voltage_limit}
            )
        )
    failing = int((learned.contraction >= 1).sum())
    if failing:
        values = {"count": failing, "samples": samples, "worst": float(learned.contraction.max())}
        found.append(Finding("learning-not-promised", values=values))
    if learned.limited.any():
        values = {"count": int(learned.limited.sum()), "samples": samples, "voltage": learned.voltage_limit}
        found.append(Finding("learning-limited", values=values))
    if samples == 1:
        found.append(Finding("learning-nominal"))
    return tuple(found)
