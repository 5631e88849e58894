"""Control of a strip's position: the voltage for a path (or for one of the force), the loop, python-control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack, overload

from ..arrays import one_thread
from ..circuit.load import Hung, load_of
from ..control.close import Closed, read_controller
from ..control.close import close_loop as close_room
from ..control.export import c_text
from ..control.export import to_control as control_of
from ..control.op_amps import OpAmps
from ..control.plant import unit_of
from ..control.sampled import Late, Sensor
from ..control.track import NODES, Tracked
from ..control.track import track as track_room
from ..control.track_shape import track_shape
from ..control.tracked_shape import TrackedShape
from ..errors import InputError, argument, checked
from ..extras import require_control, require_python_control
from ..simulation.response import Response
from .given import Driven, Given, Strip, drive_of, engine_of, lasting, optional, quantity
from .given import load as strip_of
from .goals import drift_of
from .targets import Targets, lasting_all, limits_of, targets_of


class _Asked(TypedDict, total=False):
    """Limits, mechanics and solver of `track`."""

    voltage: Given | Sequence[Given]
    slew: Given | Sequence[Given] | None
    current: Given | Sequence[Given] | None
    energy: Given | None
    alike: bool
    nodes: int
    beam: str | None
    load: Hung
    band: bool
    engine: str | None


@overload
def track(
    strip: Strip,
    path: Driven,
    duration: Given | None = None,
    *,
    quantity: Literal["displacement", "force"] = "displacement",
    **asked: Unpack[_Asked],
) -> Tracked: ...
@overload
def track(
    strip: Strip,
    path: Driven | Targets,
    duration: Given | None = None,
    *,
    quantity: Literal["shape"],
    **asked: Unpack[_Asked],
) -> TrackedShape: ...
@overload
def track(strip: Strip, path: Targets, duration: Given | None = None, **asked: Unpack[_Asked]) -> TrackedShape: ...
@checked
@one_thread()
def track(
    strip: Strip,
    path: Driven | Targets,
    duration: Given | None = None,
    *,
    quantity: str | None = None,
    voltage: Given | Sequence[Given] = 4.0,
    slew: Given | Sequence[Given] | None = None,
    current: Given | Sequence[Given] | None = None,
    energy: Given | None = None,
    alike: bool = False,
    nodes: int = NODES,
    beam: str | None = None,
    load: Hung = None,
    band: bool = False,
    engine: str | None = None,
) -> Tracked | TrackedShape:
    """Return the voltage whose displacement, force or shape is nearest to a path, within limits, and how near that is.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    path : str, Drive, (times, values), mapping or Response
        Where the tip shall be: a text such as "sine:1mm,10mHz" or "file:path.csv" (the forms of `sense`), or a pair of
        times [s] and positions [m] (n,). For a force the same in newtons: "sine:100nN,5mHz". For a shape a mapping
        ``{"curvature_1": "step:10 1/m", "curvature_2": (times, values), "displacement": "sine:1mm,5mHz"}``, with the
        curvature [1/m] of a segment also under its number; or a file with such columns; or a run of `simulate`.
    duration : float or str, optional
        Duration [s]; not needed for a file, a pair of arrays or a run, which end by themselves.
    quantity : {"displacement", "force", "shape"}, optional
        What follows the path: the displacement of the free tip; the blocked force of the clamped one, as
        ``simulate(..., tip="clamped")`` gives it; or the shape of a strip with segments, each with a voltage of its
        own (default: displacement, of several paths the shape).
    voltage : float, str or list
        Limit [V] of the voltage, of either sign; of a shape one for all segments, or one for each.
    slew : float, str or list, optional
        Limit [V/s] of the voltage's rate, such as "1 V/s", likewise; the voltage then starts from zero.
    current : float, str or list, optional
        Limit [A] of the current, at the nodes, likewise.
    energy : float or str, optional
        Limit [J] of the energy that is delivered, by all sources.
    alike : bool
        Gives all segments one voltage, for a shape.
    nodes : int
        Number of points, equally apart, between which the voltage is straight.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".
    band : bool
        Adds the standard error of the quantity from the uncertainty of a fitted strip.
    engine : {"ngspice", "exact"}, optional
        Solver of the run under the voltage found (default: exact, for nonlinear strips ngspice).

    Returns
    -------
    Tracked or TrackedShape
        ``time`` [s], ``path``, ``output`` and ``error`` [m] or [N], ``displacement`` [m], ``force`` [N], ``voltage``
        [V] and ``current`` [A], each an array (m,); ``drive`` for `simulate`; ``followed``, ``at_limit``, ``reach`` [m]
        or [N], ``rate`` [m/s] or [N/s]. Of a shape ``paths``, ``outputs`` and ``errors`` by target, ``voltages`` and
        ``currents`` by segment. See `ilg.results`.

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
    (True, '3.46 V, at a limit 0% of the time')
    >>> pressed = ilg.track("paper", "sine:100nN,5mHz", "400 s", quantity="force", nodes=101, beam="static")
    >>> pressed.followed, f"{1e9 * max(pressed.force):.0f} nN, {max(pressed.voltage):.2f} V"
    (True, '100 nN, 2.62 V')
    >>> sheets = {"sheet_resistance_1": 5, "sheet_resistance_2": 5, "segments_1": 2, "segments_2": 2, "cells": 4}
    >>> cut = ilg.PAPER.with_(electrodes=sheets)
    >>> bent = ilg.track(cut, {1: "sine:5 1/m,5mHz", 2: "sine:-5 1/m,5mHz"}, "200 s", nodes=41, beam="static")
    >>> bent.followed, [f"{max(volts):.2f} V" for volts in bent.voltages.values()]
    (True, ['3.16 V', '2.23 V'])
    """
    require_control()
    actuator = strip_of(strip)
    chosen = engine or ("exact" if actuator.material.model.linear else engine_of(None, actuator))
    how: dict[str, Any] = {"beam": beam, "load": load_of(load), "band": band, "engine": chosen, "nodes": nodes}
    seconds = optional(duration, "s", "duration")
    several = isinstance(path, Mapping | Response)
    quantity = quantity or ("shape" if several else "displacement")
    if quantity == "shape":
        sources = targets_of(path, seconds or 0.0)
        lasts = lasting_all(sources, seconds)
        return track_shape(actuator, sources, lasts, limits_of(voltage, slew, current, energy), alike=alike, **how)
    if isinstance(path, Mapping | Response):
        raise InputError(f"a path of several targets is that of a shape; give {argument('quantity', 'shape')}, or none")
    if alike:
        raise InputError(
            f"{argument('alike')} goes with {argument('quantity', 'shape')}; of another quantity all segments are alike"
        )
    source = drive_of(path, seconds or 0.0, unit_of(quantity))
    (limits,) = limits_of(voltage, slew, current, energy, most=1)
    return track_room(actuator, source, lasting(source, seconds), limits, quantity=quantity, **how)


@checked
@one_thread()
def close_loop(
    strip: Strip,
    controller: Any,
    reference: Driven,
    duration: Given,
    *,
    form: str = "sampled",
    period: Given | None = None,
    voltage: Given | None = None,
    delay: Given = 0.0,
    noise: Given = 0.0,
    quantum: Given = 0.0,
    computation: Given = 0.0,
    jitter: Given = 0.0,
    pwm: Given | None = None,
    duty_steps: int = 256,
    seed: int = 0,
    gain_bandwidth: Given | None = None,
    supply: Given | None = None,
    sensor_gain: Given | None = None,
    drift: str | Mapping[str, Given] | None = None,
    adapt: bool = False,
    samples: int = 601,
    beam: str | None = None,
    load: Hung = None,
    engine: str | None = None,
) -> Closed:
    """Return the position loop of a strip and a controller over time.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    controller : Tuned, str, Path or object
        What `tune` returned, the JSON file that it wrote, a Python file, or any object with
        ``step(reference, measured) -> voltage`` in metres and volts, of which every run has its own copy.
    reference : str, Drive or (times, values)
        Where the tip shall be: a text such as "step:3mm", or a pair of times [s] and positions [m] (n,).
    duration : float or str
        Duration [s].
    form : {"sampled", "behavioural", "op-amps"}
        Whether the controller is called at every ``period``, or is a part of the circuit, which needs a tuned one: as
        behavioural sources, or a PI of operational amplifiers, resistors of E24 and capacitors of E12.
    period : float or str, optional
        Time between calls [s].
    voltage : float or str, optional
        Limit [V] of the voltage, of either sign (default: the tuned controller's, else 4 V).
    delay : float or str
        Delay [s] of the measurement.
    noise : float or str
        Standard deviation [m] of a measurement.
    quantum : float or str
        Step [m] in which the measurement comes.
    computation : float or str
        Time [s] from a call to its voltage, shorter than the period.
    jitter : float or str
        Time [s] by which a voltage comes later than that, at most; by chance, equally distributed.
    pwm : float or str, optional
        Frequency [Hz] of a pulse-width modulated stage: an H-bridge that gives its ``supply`` for a part of each cycle.
        It is solved by the exact engine, switching and all.
    duty_steps : int
        Steps of its duty.
    seed : int
        Seed of the noise.
    gain_bandwidth : float or str, optional
        Gain-bandwidth product [Hz] of operational amplifiers (default 1 MHz).
    supply : float or str, optional
        Supply [V] of operational amplifiers, of either sign (default 15 V), or of the stage (default: the limit).
    sensor_gain : float or str, optional
        Voltage per length [V/m] of the sensor and the reference before operational amplifiers (default 1 V/mm).
    drift : str or mapping, optional
        Changes of the strip from the start to the end of the run, as of one that dries:
        "capacitance=-40%,dynamic_resistance=+80%". Names are capacitance, dynamic_resistance, dc_resistance and gain.
        It is solved by the exact engine.
    adapt : bool
        Makes a tuned PI, sampled, identify the strip while it runs, and reschedule its gains; see `adaptive`.
    samples : int
        Number of samples that are returned, equally apart.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".
    engine : {"ngspice", "exact"}, optional
        Solver of a sampled loop: ngspice, or matrix exponentials, for linear circuits only (default: ngspice; without
        its library exact, with a warning). A controller in the circuit is solved by ngspice.

    Returns
    -------
    Closed
        ``time`` [s], ``reference`` and ``displacement`` [m], ``voltage`` [V] and ``current`` [A], each an array (n,);
        ``waves.measured`` [m]; ``netlist`` of a controller in the circuit, ``circuit`` of one with operational
        amplifiers (``gain``, ``reset_time``, ``deviations``, ``table()`` of parts); ``run.settled()``. See
        `ilg_circuit.results`.

    Raises
    ------
    InputError
        A value is not understood or out of range, or the controller is none.
    SolveError
        The controller's ``step`` raised or returned no finite voltage, or the circuit cannot be solved.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> class Proportional:
    ...     def step(self, reference, measured):
    ...         return 1000 * reference + 5000 * (reference - measured)
    >>> closed = ilg.close_loop("paper", Proportional(), "step:3mm", "60 s", period="0.1 s", engine="exact")
    >>> f"{1e3 * closed.displacement[-1]:.2f} mm"
    '2.99 mm'
    """
    actuator = strip_of(strip)
    seconds = quantity(duration, "s", "duration")
    sensor = Sensor(
        quantity(delay, "s", "delay"), quantity(noise, "m", "noise"), quantity(quantum, "m", "quantum"), seed
    )
    stage = None
    if pwm is not None:
        stage, supply = (quantity(pwm, "Hz", "pwm"), optional(supply, "V", "supply"), duty_steps), None
    if drift or stage:
        engine = engine or "exact"
    asked = {
        "gain_bandwidth": optional(gain_bandwidth, "Hz", "gain_bandwidth"),
        "supply": optional(supply, "V", "supply"),
        "sensor_gain": optional(sensor_gain, "V/m", "sensor_gain"),
    }
    amplifiers = {name: value for name, value in asked.items() if value is not None}
    return close_room(
        actuator,
        controller,
        drive_of(reference, seconds, "m"),
        seconds,
        form=form,
        period=optional(period, "s", "period"),
        limit=optional(voltage, "V", "voltage"),
        sensor=sensor,
        late=Late(quantity(computation, "s", "computation"), quantity(jitter, "s", "jitter")),
        pwm=stage,
        samples=samples,
        beam=beam,
        load=load_of(load),
        engine=engine_of(engine, actuator) if form == "sampled" else "ngspice",
        drift=drift_of(drift),
        adapts=adapt,
        op_amps=OpAmps(**amplifiers) if amplifiers else None,
    )


@checked
def to_control(strip: Strip, *, tip: str = "free", beam: str | None = None, load: Hung = None) -> Any:
    """Return a strip as a state space of python-control, for small signals about rest.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    tip : {"free", "clamped"}
        Whether the tip moves.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".

    Returns
    -------
    control.StateSpace
        Input ``u`` [V]; outputs ``y`` (displacement [m]), ``i`` (current [A]) and ``F`` (force [N]).

    Raises
    ------
    InputError
        A value is not understood.
    MissingLibraryError
        python-control is not installed; it comes with the extra ``control``.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> system = ilg.to_control("paper", beam="static")
    >>> system.input_labels, system.output_labels
    (['u'], ['y', 'i', 'F'])
    """
    require_python_control()
    return control_of(strip_of(strip), beam, load_of(load), tip)


def controller_code(controller: Path, period: Given | None, voltage: Given | None = None) -> str:
    """Return the C text of the tuned controller in a JSON file. Raises InputError for another file, or no period."""
    found = read_controller(controller)
    if not isinstance(found, tuple):
        raise InputError(f"'{controller}' is no tuned controller; C is written of one that tune wrote with --json")
    if period is None:
        raise InputError(f"{argument('period')} is missing: C is written of a sampled controller")
    law, limit = found
    return c_text(law, quantity(period, "s", "period"), limit if voltage is None else quantity(voltage, "V", "voltage"))
