"""Tunes a position controller for a strip: the wish, the law that grants it best, and its margins over the fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, ComplexArray, plain
from ..circuit.load import Load
from ..errors import InputError, SolveError, argument
from ..findings import Finding, Warned
from ..result import Column, Result
from ..strip.actuator import Actuator
from ..units import format_quantity
from .bound import fastest_settling
from .laws import Law, kind_of, law_of
from .loop import BAND, Loop, Run
from .margins import MOST_SENSITIVE, Margins, frequencies, largest_delay, margins
from .plant import first_mode, plants_of, responses
from .search import Wish, best_law

#: Samples of the covariance, and overshoot that is allowed.
DRAWS, OVERSHOOT = 200, 0.05
#: Length of the run that is shown, in settling times of the bound, and that of one that does not settle, at most;
#: frequencies and samples of the cloud.
_SHOWN, _LONGEST, _POINTS, _CLOUD = 4.0, 64.0, 300, 100
#: Published share of the first resonance that a cantilever's closed loop reaches (Kothera and Leo 2005).
_REACHED = 0.1

Progress = Callable[[int, int], None]


@dataclass(frozen=True, repr=False, eq=False)
class Tuned(Warned, Result):
    """A tuned position controller and the loop that it makes, as `ilg_circuit.tune` returns it.

    Attributes
    ----------
    actuator : Actuator
        The strip.
    beam : str
        "dynamic" or "static".
    law : Law
        The controller: its ``kind``, its ``gains`` by name in SI units, and its state space.
    wish : Wish
        What was asked for: step [m], limit [V], delay [s], largest sensitivity, goal.
    margins : Margins
        Gain, phase [rad], delay [s], disk margin, largest sensitivity and bandwidth [Hz] of the nominal loop and of
        the samples of the covariance, each an array (samples,).
    run : Run
        The step response of the limited loop over ``time`` [s] (n,).
    delay : float
        Largest delay [s] of the measurement at which all samples keep the sensitivity.
    resonance : float or None
        First mode of the beam [Hz], None for a beam without mass.
    frequency : ndarray (f,)
        Angular frequencies [rad/s] of the loop gains.
    loops : ndarray (samples, f)
        Complex loop gains, the nominal one first.
    findings : tuple of Finding
        What the loop should be known for.
    """

    presenter: ClassVar[str] = "tune"
    actuator: Actuator
    beam: str
    law: Law
    wish: Wish
    margins: Margins
    run: Run
    delay: float
    resonance: float | None
    frequency: Array
    loops: ComplexArray
    findings: tuple[Finding, ...] = field(default=())

    @property
    def time(self) -> Array:
        """Times of the step response [s] (n,)."""
        return self.run.time

    @property
    def settling(self) -> float:
        """Time [s] after which the displacement stays within 2 % of the step; inf if it does not within the run."""
        return self.run.settled()

    @property
    def overshoot(self) -> float:
        """Part of the step by which the displacement goes beyond it."""
        return self.run.overshoot

    @property
    def robust(self) -> bool:
        """Whether all samples keep the largest sensitivity that is allowed."""
        return bool(self.margins.sensitivity.max() <= self.wish.most)

    @property
    def met(self) -> bool:
        """Whether the loop is robust, reaches its goal and overshoots no more than allowed."""
        wish, reached = self.wish, True
        if wish.settling is not None:
            reached = self.settling <= wish.settling
        if wish.bandwidth is not None:
            reached = reached and float(self.margins.bandwidth[0]) >= wish.bandwidth
        return bool(self.robust and reached and np.isfinite(self.settling) and self.overshoot <= wish.overshoot)

    def table(self) -> tuple[Column, ...]:
        """Return the step response: time, reference, displacement and voltage (n,)."""
        run = self.run
        return (
            Column("time", run.time, "s", over=True),
            Column("reference", run.reference, "m"),
            Column("displacement", run.displacement, "m"),
            Column("voltage", run.voltage, "V"),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the controller, its margins and the step response as plain data; None for what is not finite."""
        wish, law = self.wish, self.law
        return {
            "actuator": self.actuator.name,
            "beam": self.beam,
            "controller": controller_data(law, wish.limit, wish.delay),
            "step": wish.step,
            "settling": _number(self.settling),
            "overshoot": self.overshoot,
            "bound": wish.bound,
            "goal": {"settling": wish.settling, "bandwidth": wish.bandwidth, "overshoot": wish.overshoot},
            "sensitivity_allowed": wish.most,
            "robust": self.robust,
            "met": self.met,
            "samples": len(self.margins.gain) - 1,
            "margins": {
                what: {name: _number(value) for name, value in self.margins.of(what).items()}
                for what in ("nominal", "5 %", "worst")
            },
            "largest_delay": _number(self.delay),
            "first_mode": self.resonance,
            "waveforms": {column.header: plain(np.asarray(column.values)) for column in self.table()},
            "findings": [finding.to_dict() for finding in self.findings],
        }


def controller_data(law: Law, limit: float, delay: float) -> dict[str, Any]:
    """Return a law as plain data: its kind, its gains, the limit [V], the delay [s], the state space."""
    return {
        "kind": law.kind,
        "gains": {name: float(value) for name, value in law.gains.items()},
        "limit": limit,
        "delay": delay,
        "clamps": law.clamps,
        "state_space": {
            "a": law.a.tolist(),
            "b_reference": law.into_reference.tolist(),
            "b_displacement": law.into_measured.tolist(),
            "b_excess": law.into_excess.tolist(),
            "c": law.out.tolist(),
            "d_reference": law.reference,
            "d_displacement": law.measured,
        },
    }


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


def tune(
    actuator: Actuator,
    step: float,
    kind: str = "pi",
    *,
    settling: float | None = None,
    bandwidth: float | None = None,
    gains: Mapping[str, float] | None = None,
    judged: Law | None = None,
    limit: float = 4.0,
    delay: float = 0.0,
    sensitivity: float = MOST_SENSITIVE,
    overshoot: float = OVERSHOOT,
    anti_windup: str = "back-calculation",
    tracking_time: float | None = None,
    beam: str | None = None,
    load: Load | None = None,
    draws: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Tuned:
    """Return the controller of a ``kind`` that grants a wish best, or what one with ``gains`` [SI] or a law is worth.

    Raises InputError for a value out of range, SolveError where no controller can settle in time, none is robust, or
    the loop with the gains or the law given is unstable.
    """
    kind_of(kind)
    _require(step, limit, delay, sensitivity, overshoot)
    plants = plants_of(actuator, beam=beam, load=load, draws=draws_of(actuator, draws), seed=seed)
    bound = fastest_settling(plants[0], step, limit)
    if settling is not None and not settling >= bound:
        raise SolveError(
            f"settling in {settling:g} s is impossible: no voltage within +-{limit:g} V brings {1e3 * step:g} mm to "
            f"within {100 * BAND:g} % sooner than {bound:.4g} s; ask for more time, a smaller step or more voltage"
        )
    wish = Wish(step, limit, delay, sensitivity, overshoot, bound, settling, bandwidth)
    if judged is not None:
        if gains is not None:
            raise InputError(f"{argument('gains')} and {argument('controller')} both say which one is judged")
        law = judged
    elif gains is None:
        law = best_law(kind, plants, wish, seed, progress)
    else:
        law = law_of(kind, plants[0], gains)
    law = law.guarded(anti_windup, tracking_time)
    found = margins(plants, law, delay)
    if not found.stable[0]:
        raise SolveError(
            f"the loop with {_said(law)} is unstable, measured {delay:g} s late; take less gain, or leave "
            f"{argument('gains' if judged is None else 'controller')} out to have it tuned"
        )
    duration = _SHOWN * max(bound, settling or 0.0)
    loop = Loop(plants[0], law, limit, delay)
    run = loop.run(np.zeros(1), np.array([step]), duration)
    while not np.isfinite(run.settled()) and duration < _LONGEST * bound:
        duration *= 2
        run = loop.run(np.zeros(1), np.array([step]), duration)
    loops_at = frequencies(plants[:1], law, _POINTS)
    late = np.exp(-1j * loops_at * delay)
    tuned = Tuned(
        actuator=actuator,
        beam=actuator.beam(beam, loaded=bool(load)),
        law=law,
        wish=wish,
        margins=found,
        run=run,
        delay=largest_delay(plants, law, sensitivity),
        resonance=first_mode(actuator, beam, load),
        frequency=loops_at,
        loops=responses(plants[: _CLOUD + 1], loops_at) * law.response(loops_at) * late,
    )
    object.__setattr__(tuned, "findings", _findings(tuned))
    return tuned


def draws_of(actuator: Actuator, draws: int | None) -> int:
    """Return how many samples of a strip's covariance are taken. Raises InputError for too many."""
    if draws is None:
        return DRAWS if actuator.uncertainty is not None else 0
    if not 0 <= draws <= 10_000:
        raise InputError(f"{argument('draws')} is {draws}; give 0 to 10000")
    return draws


def _require(step: float, limit: float, delay: float, sensitivity: float, overshoot: float) -> None:
    """Raise InputError for values that no loop has."""
    for name, value, unit in (("step", step, "m"), ("voltage", limit, "V")):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{argument(name)} is {value:g} {unit}; it must be more than zero")
    if not (np.isfinite(delay) and delay >= 0):
        raise InputError(f"{argument('delay')} is {delay:g} s; it must be zero or more")
    if not sensitivity > 1:
        raise InputError(f"{argument('sensitivity')} is {sensitivity:g}; it must be more than 1, such as 1.6")
    if not 0 <= overshoot < 1:
        raise InputError(f"{argument('overshoot')} is {overshoot:g}; give 0 to 1, such as 0.05")


def _said(law: Law) -> str:
    """Return a law with its gains, in words."""
    units = kind_of(law.kind).units
    return f"{law.kind} " + ", ".join(
        f"{name} {format_quantity(float(value), units.get(name, ''), 4)}" for name, value in law.gains.items()
    )


def _findings(tuned: Tuned) -> tuple[Finding, ...]:
    """Return what the loop should be known for."""
    wish, found = tuned.wish, []
    worst = float(tuned.margins.sensitivity.max())
    if not tuned.robust:
        nominal = float(tuned.margins.sensitivity[0])
        found.append(Finding("loop-too-sensitive", values={"worst": worst, "nominal": nominal, "allowed": wish.most}))
    if wish.settling is not None and not tuned.settling <= wish.settling:
        values = {"settling": tuned.settling, "wanted": wish.settling, "bound": wish.bound}
        found.append(Finding("settling-missed", values=values))
    if not np.isfinite(tuned.settling):
        found.append(Finding("loop-not-settled", values={"duration": float(tuned.time[-1])}))
    if wish.bandwidth is not None and not float(tuned.margins.bandwidth[0]) >= wish.bandwidth:
        values = {"bandwidth": float(tuned.margins.bandwidth[0]), "wanted": wish.bandwidth}
        found.append(Finding("bandwidth-missed", values=values))
    if tuned.overshoot > wish.overshoot:
        found.append(Finding("overshoot-missed", values={"overshoot": tuned.overshoot, "allowed": wish.overshoot}))
    if len(tuned.margins.gain) == 1:
        found.append(Finding("margins-nominal"))
    if not tuned.actuator.material.model.linear:
        found.append(Finding("tuned-about-rest"))
    bandwidth = float(tuned.margins.bandwidth[0])
    if tuned.resonance is not None and np.isfinite(bandwidth) and bandwidth > _REACHED * tuned.resonance:
        share = bandwidth / tuned.resonance
        found.append(Finding("bandwidth-near-mode", values={"share": share, "mode": tuned.resonance}))
    if tuned.resonance is None:
        mode = first_mode(tuned.actuator, "dynamic")
        if mode is not None and np.isfinite(bandwidth) and bandwidth > _REACHED * mode:
            found.append(Finding("static-beam-tuned", values={"bandwidth": bandwidth, "mode": mode}))
    return tuple(found)
