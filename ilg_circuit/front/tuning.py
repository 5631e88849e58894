"""Tuning of a position controller, and one that tunes itself while it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from ..arrays import one_thread
from ..circuit.load import Hung, load_of
from ..control.adaptive import MEMORY, NOISE, Adaptive
from ..control.close import read_controller
from ..control.laws import Law
from ..control.margins import MOST_SENSITIVE
from ..control.tune import OVERSHOOT, Tuned
from ..control.tune import tune as tune_room
from ..errors import InputError, checked
from .given import Given, Strip, optional, quantity
from .given import load as strip_of
from .goals import gains_of, goals_of


@checked
@one_thread()
def tune(
    strip: Strip,
    step: Given,
    kind: str = "pi",
    *,
    to: str | None = None,
    gains: str | Mapping[str, str | float] | None = None,
    controller: Tuned | str | Path | None = None,
    voltage: Given = 4.0,
    delay: Given = 0.0,
    sensitivity: float = MOST_SENSITIVE,
    overshoot: Given = OVERSHOOT,
    anti_windup: str = "back-calculation",
    tracking_time: Given | None = None,
    beam: str | None = None,
    load: Hung = None,
    draws: int | None = None,
    seed: int = 0,
    progress: Callable[..., Any] | None = None,
) -> Tuned:
    """Return a position controller for a strip, tuned for a step and robust over the uncertainty of the strip's fit.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name; a fitted strip brings the covariance.
    step : float or str
        Step of the reference [m], such as "3 mm"; the voltage's limit makes settling depend on it.
    kind : {"pi", "pid", "lqg", "adrc"}
        Kind of controller: PI or PID with a filtered derivative, a linear-quadratic regulator behind a Kalman filter
        that also estimates a constant error of the voltage, or linear active disturbance rejection.
    to : str, optional
        Goal: "settling=30s" or "bandwidth=20mHz"; the soonest settling if left out.
    gains : str or mapping, optional
        Gains that are judged in place of tuned ones, such as "gain=20V/mm,reset_time=10s".
    controller : Tuned, str or Path, optional
        A controller that is judged as it is, whatever strip it was tuned for: what `tune` returned, or the JSON file
        that it wrote.
    voltage : float or str
        Limit [V] of the voltage, of either sign.
    delay : float or str
        Delay [s] of the measurement, such as a camera's.
    sensitivity : float
        Largest abs(S) that is allowed at every sample, S = 1/(1 + loop gain).
    overshoot : float or str
        Largest overshoot allowed, as a part of the step.
    anti_windup : {"back-calculation", "clamping", "none"}
        What keeps the integral from winding up at the limit; clamping holds it within the limit.
    tracking_time : float or str, optional
        Time constant [s] of back-calculation (default: the reset time).
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".
    draws : int, optional
        Samples of the covariance (default 200; none for a strip without a covariance).
    seed : int
        Seed of samples and search.
    progress : callable, optional
        Function that is called with (done, total).

    Returns
    -------
    Tuned
        ``law`` with its ``gains``, ``margins`` over the samples, ``settling`` [s], ``overshoot``, the step response
        ``run``, the largest ``delay`` [s] that still holds, ``wish.bound`` [s], ``met``. See `ilg.results`.

    Raises
    ------
    InputError
        A value is not understood or out of range, or no voltage within the limit holds the step.
    SolveError
        No controller can settle in time, none of this kind is robust, or the loop with the one given is unstable.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> tuned = ilg.tune("paper", "3 mm", gains="gain=20V/mm,reset_time=10s", beam="static")
    >>> f"{tuned.settling:.2f} s, {tuned.overshoot:.2%}, no sooner than {tuned.wish.bound:.1f} s"
    '27.19 s, 3.87%, no sooner than 20.6 s'
    """
    goals = goals_of(to)
    return tune_room(
        strip_of(strip),
        quantity(step, "m", "step"),
        kind,
        settling=goals.get("settling"),
        bandwidth=goals.get("bandwidth"),
        judged=None if controller is None else _law(controller),
        gains=gains_of(kind, gains),
        limit=quantity(voltage, "V", "voltage"),
        delay=quantity(delay, "s", "delay"),
        sensitivity=sensitivity,
        overshoot=quantity(overshoot, "", "overshoot"),
        anti_windup=anti_windup,
        tracking_time=optional(tracking_time, "s", "tracking_time"),
        beam=beam,
        load=load_of(load),
        draws=draws,
        seed=seed,
        progress=progress,
    )


def _law(controller: Tuned | str | Path) -> Law:
    """Return the law of a tuned controller. Raises InputError for another one."""
    if isinstance(controller, Tuned):
        return controller.law
    found = read_controller(Path(controller))
    if not isinstance(found, tuple):
        raise InputError(f"'{controller}' is no tuned controller; give the JSON file of tune")
    law: Law = found[0]
    return law


@checked
@one_thread()
def adaptive(
    strip: Strip,
    controller: Tuned | str | Path,
    period: Given,
    *,
    estimated: Iterable[str] = (),
    memory: Given = MEMORY,
    noise: Given = NOISE,
    voltage: Given = 4.0,
    beam: str | None = None,
    load: Hung = None,
) -> Adaptive:
    """Return a PI controller that identifies its strip while it runs, and reschedules its gains.

    Recursive least squares find what the strip's capacitance and resistance are of those fitted, where the coupling
    follows the charge, or its gain, where it follows the voltage. The gains keep the loop gain at the crossover.

    Parameters
    ----------
    strip : Actuator, str or Path
        The strip as it was fitted, linear, of model rc: an object, the path of a TOML file or a preset's name.
    controller : Tuned, str or Path
        The PI for it: what `tune` returned, or the JSON file that it wrote.
    period : float or str
        Time between calls [s].
    estimated : iterable of str
        Names of what is found: capacitance, dynamic_resistance, dc_resistance, gain (default: see above). The
        displacement shows only the product of gain and capacitance.
    memory : float or str
        Time [s] over which the past is forgotten: an estimate of what drifts is so late.
    noise : float or str
        Standard deviation [m] of a measurement.
    voltage : float or str
        Limit [V] of the voltage, of either sign.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".

    Returns
    -------
    Adaptive
        An object with ``step(reference, measured) -> voltage`` for `close_loop` or a program of your own, called every
        period from rest on; ``estimates`` by name, a number for each call; ``gains`` now.

    Raises
    ------
    InputError
        A value is not understood or out of range, the strip is nonlinear or of another model, the controller no PI.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> tuned = ilg.tune("paper", "3 mm", gains="gain=5V/mm,reset_time=15s", beam="static")
    >>> controller = ilg.adaptive("paper", tuned, "0.5 s", beam="static")
    >>> drying = {"drift": "gain=-50%", "engine": "exact", "beam": "static", "period": "0.5 s"}
    >>> run = ilg.close_loop("paper", controller, "sine:1mm,10mHz", "400 s", **drying)
    >>> f"{run.waves.estimates['gain'][-1]:.2f}"
    '0.56'
    """
    how: dict[str, Any] = {"memory": quantity(memory, "s", "memory"), "noise": quantity(noise, "m", "noise")}
    limit = quantity(voltage, "V", "voltage")
    seconds, names = quantity(period, "s", "period"), tuple(estimated)
    how |= {"estimated": names, "beam": beam, "load": load_of(load)}
    return Adaptive(strip_of(strip), _law(controller), seconds, limit, **how)
