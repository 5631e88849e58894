"""Control of a strip's position."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ..circuit.load import Hung, load_of
from ..control.laws import kind_of
from ..control.programme import Limits
from ..control.track import NODES, Tracked
from ..control.track import track as track_room
from ..control.tune import MOST_SENSITIVE, OVERSHOOT, Tuned
from ..control.tune import tune as tune_room
from ..drive import PiecewiseLinear
from ..errors import InputError, argument, checked, unknown_name
from ..units import si
from .given import Driven, Given, Strip, drive_of, engine_of, optional, quantity
from .given import load as strip_of


@checked
def tune(
    strip: Strip,
    step: Given,
    kind: str = "pi",
    *,
    to: str | None = None,
    gains: str | Mapping[str, str | float] | None = None,
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
        No controller can settle in time, none of this kind is robust, or the loop with the gains given is unstable.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> tuned = ilg.tune("paper", "3 mm", gains="gain=20V/mm,reset_time=10s", beam="static")
    >>> f"{tuned.settling:.2f} s, {tuned.overshoot:.2%}, no sooner than {tuned.wish.bound:.1f} s"
    '27.19 s, 3.87%, no sooner than 20.6 s'
    """
    goals = _goals(to)
    return tune_room(
        strip_of(strip),
        quantity(step, "m", "step"),
        kind,
        settling=goals.get("settling"),
        bandwidth=goals.get("bandwidth"),
        gains=_gains(kind, gains),
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


@checked
def track(
    strip: Strip,
    path: Driven,
    duration: Given | None = None,
    *,
    voltage: Given = 4.0,
    slew: Given | None = None,
    current: Given | None = None,
    energy: Given | None = None,
    nodes: int = NODES,
    beam: str | None = None,
    load: Hung = None,
    band: bool = False,
    engine: str | None = None,
) -> Tracked:
    """Return the voltage whose displacement is nearest to a path, within limits, and how near that is.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    path : str, Drive or (times, values)
        Where the tip shall be: a text such as "sine:1mm,10mHz" or "file:path.csv" (the forms of `sense`), or a pair of
        times [s] and positions [m] (n,).
    duration : float or str, optional
        Duration [s]; not needed for a file or a pair of arrays, which end by themselves.
    voltage : float or str
        Limit [V] of the voltage, of either sign.
    slew : float or str, optional
        Limit [V/s] of the voltage's rate, such as "1 V/s"; the voltage then starts from zero.
    current : float or str, optional
        Limit [A] of the current, at the nodes.
    energy : float or str, optional
        Limit [J] of the energy that is delivered.
    nodes : int
        Number of points, equally apart, between which the voltage is straight.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".
    band : bool
        Adds the standard error of the displacement from the uncertainty of a fitted strip.
    engine : {"ngspice", "exact"}, optional
        Solver of the run under the voltage found (default: exact, for nonlinear strips ngspice).

    Returns
    -------
    Tracked
        ``time`` [s], ``path``, ``displacement`` and ``error`` [m], ``voltage`` [V] and ``current`` [A], each an array
        (m,); ``drive`` for `simulate`; ``followed``, ``at_limit``, ``reach`` [m], ``rate`` [m/s]. See `ilg.results`.

    Raises
    ------
    InputError
        A value is not understood or out of range.
    SolveError
        No voltage keeps the limits.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> slow = ilg.track("paper", "sine:3mm,5mHz", "400 s", nodes=101, beam="static")
    >>> slow.followed, f"{max(slow.voltage):.2f} V, at a limit {slow.at_limit:.0%} of the time"
    (True, '3.18 V, at a limit 0% of the time')
    """
    from ..extras import require_control

    require_control()
    actuator = strip_of(strip)
    seconds = None if duration is None else quantity(duration, "s", "duration")
    source = drive_of(path, seconds or 0.0, "m")
    if seconds is None:
        if not (isinstance(source, PiecewiseLinear) and source.times[-1] > 0):
            raise InputError(f"{argument('duration')} is missing: say how long, such as '300 s'")
        seconds = float(source.times[-1])
    limits = Limits(
        quantity(voltage, "V", "voltage"),
        optional(slew, "V/s", "slew"),
        optional(current, "A", "current"),
        optional(energy, "J", "energy"),
    )
    chosen = engine or ("exact" if actuator.material.model.linear else engine_of(None, actuator))
    how: dict[str, Any] = {"beam": beam, "load": load_of(load), "band": band, "engine": chosen}
    return track_room(actuator, source, seconds, limits, nodes=nodes, **how)


def _goals(text: str | None) -> dict[str, float]:
    """Return the goals of a text such as "settling=30s"."""
    units = {"settling": "s", "bandwidth": "Hz"}
    found: dict[str, float] = {}
    for part in (text or "").split(",") if text else ():
        name, _, value = part.partition("=")
        if name.strip() not in units:
            raise unknown_name("goal", name.strip(), units)
        found[name.strip()] = si(value, units[name.strip()], f"{argument('to')}, {name.strip()}")
        if not found[name.strip()] > 0:
            raise InputError(f"{argument('to')}: '{part}' must be more than zero")
    return found


def _gains(kind: str, given: str | Mapping[str, str | float] | None) -> dict[str, float] | None:
    """Return gains [SI] by name from a text or a mapping."""
    if given is None:
        return None
    units = kind_of(kind).units
    if isinstance(given, str):
        given = dict(part.partition("=")[::2] for part in given.split(","))
    found = {}
    for name, value in given.items():
        key = str(name).strip()
        if key not in units:
            raise unknown_name(f"gain of {kind}", key, units)
        found[key] = si(value, units[key], f"{argument('gains')}, {key}")
    return found
