"""Closes the loop around a strip: a sampled controller in either engine, or a law as a part of the circuit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, plain
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..drive import Drive
from ..errors import InputError, argument, first_line, wrong_choice
from ..findings import Finding, Warned
from ..result import Column, Result
from ..simulation.response import transient_band
from ..strip.actuator import Actuator
from .adaptive import NOISE, Adaptive
from .behavioural import behavioural, loop_deck, run_looped, with_op_amps
from .drift import drifting, unseen
from .laws import Law
from .loop import Run
from .op_amps import Controller as Circuit
from .op_amps import OpAmps, op_amp_controller
from .plant import plants_of
from .pwm import Pwm
from .sampled import Controller, Late, SampledLaw, Sensor, Waves, run_exact, run_ngspice
from .tune import Tuned

#: What the controller is in the loop.
FORMS = ("sampled", "behavioural", "op-amps")
#: Times that are returned, and most calls of a controller.
_SHOWN, _MOST_CALLS = 601, 200_000


@dataclass(frozen=True, repr=False, eq=False)
class Closed(Warned, Result):
    """A strip in a closed position loop over time, as `ilg_circuit.close_loop` returns it.

    Attributes
    ----------
    actuator : Actuator
        The strip.
    form : str
        "sampled", "behavioural" or "op-amps".
    controller : str
        The controller in a few words.
    reference : ndarray (n,)
        Where the tip shall be [m].
    limit : float
        Limit of the voltage [V].
    period : float or None
        Time between calls of a sampled controller [s].
    sensor : Sensor
        Its ``delay`` [s], ``noise`` [m] and ``quantum`` [m].
    engine : str
        What solved the circuit.
    waves : Waves
        ``time`` [s], ``displacement`` [m], ``current`` [A] and ``voltage`` [V], each (n,); times ``sampled`` [s] and
        what was ``measured`` [m] then, each (k,).
    netlist : str
        The loop as a SPICE deck, "" for a sampled one.
    circuit : op_amps.Controller or None
        Of a loop with op-amps the controller's ``parts``, the ``gain`` [V/m], ``reset_time`` [s], ``weight`` and
        ``limit`` [V] that they make, and their ``deviations``.
    drift : mapping of str to float
        Factors that the strip's values ended at, by name; ``waves.estimates`` are those that a controller found, each
        an array (k,).
    stage : Pwm or None
        The stage that switches: ``frequency`` [Hz], ``supply`` [V], ``steps`` of the duty. Voltage and current are then
        means over a cycle.
    ripple : float or None
        Largest displacement about its mean within a cycle [m].
    findings : tuple of Finding
        What the loop should be known for.
    """

    presenter: ClassVar[str] = "close"
    actuator: Actuator
    form: str
    controller: str
    reference: Array
    limit: float
    period: float | None
    sensor: Sensor
    engine: str
    waves: Waves
    netlist: str = ""
    circuit: Circuit | None = None
    drift: Mapping[str, float] = field(default_factory=dict)
    stage: Pwm | None = None
    ripple: float | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def time(self) -> Array:
        """Times [s] (n,)."""
        return self.waves.time

    @property
    def displacement(self) -> Array:
        """Displacement [m] (n,)."""
        return self.waves.displacement

    @property
    def voltage(self) -> Array:
        """Voltage on the strip [V] (n,)."""
        return self.waves.voltage

    @property
    def current(self) -> Array:
        """Current into the strip [A] (n,)."""
        return self.waves.current

    @property
    def error(self) -> float:
        """Estimated error of the solution, relative to the largest displacement."""
        return self.waves.error

    @property
    def run(self) -> Run:
        """The loop as a `Run`: its ``settled()`` and ``overshoot`` refer to the last reference."""
        rate = np.gradient(self.displacement, self.time)
        return Run(self.time, self.reference, self.displacement, rate, self.voltage, self.voltage)

    def table(self) -> tuple[Column, ...]:
        """Return time, reference, displacement, voltage and current (n,)."""
        return (
            Column("time", self.time, "s", over=True),
            Column("reference", self.reference, "m"),
            Column("displacement", self.displacement, "m"),
            Column("voltage", self.voltage, "V"),
            Column("current", self.current, "A"),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the loop as plain data; waveforms are lists by header."""
        settled = self.run.settled()
        return {
            "actuator": self.actuator.name,
            "form": self.form,
            "controller": self.controller,
            "limit": self.limit,
            "period": self.period,
            "sensor": vars(self.sensor),
            "engine": self.engine,
            "estimated_error": self.error,
            "settling": settled if np.isfinite(settled) else None,
            "overshoot": self.run.overshoot if self.reference[-1] else None,
            "waveforms": {column.header: plain(np.asarray(column.values)) for column in self.table()},
            "circuit": None if self.circuit is None else self.circuit.to_dict(),
            "drift": dict(self.drift),
            "pwm": None if self.stage is None else {**vars(self.stage), "ripple": self.ripple},
            "estimates": {name: plain(values) for name, values in self.waves.estimates.items()},
            "sampled": plain(self.waves.sampled),
            "measured": plain(self.waves.measured),
            "findings": [finding.to_dict() for finding in self.findings],
        }


def law_from(data: Mapping[str, Any]) -> tuple[Law, float]:
    """Return the law of `tune.controller_data` and its limit [V]. Raises InputError for other data."""
    try:
        system = data["state_space"]
        n = len(system["c"])
        law = Law(
            str(data["kind"]),
            {str(name): float(value) for name, value in data["gains"].items()},
            a=np.array(system["a"], dtype=float).reshape(n, n),
            into_reference=np.array(system["b_reference"], dtype=float).reshape(n),
            into_measured=np.array(system["b_displacement"], dtype=float).reshape(n),
            into_excess=np.array(system["b_excess"], dtype=float).reshape(n),
            out=np.array(system["c"], dtype=float),
            reference=float(system["d_reference"]),
            measured=float(system["d_displacement"]),
            clamps=bool(data.get("clamps", False)),
        )
        return law, float(data["limit"])
    except (KeyError, TypeError, ValueError, AttributeError):
        raise InputError("the controller's data are not those that tune writes with --json") from None


def read_controller(path: Path) -> Any:
    """Return a law and its limit from the JSON file of ``tune``, or the ``controller`` of a Python file, which is run.

    A Python file without ``controller`` has a function ``step``. Raises InputError for others.
    """
    if path.suffix.lower() == ".py":
        return _from_python(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read the controller '{path}': {str(error).splitlines()[0]}") from None
    if not isinstance(content, dict) or not isinstance(content.get("controller"), dict):
        raise InputError(f"'{path}' holds no controller; give the JSON file of tune, or a Python file with step")
    return law_from(content["controller"])


def _from_python(path: Path) -> Controller:
    from runpy import run_path
    from types import SimpleNamespace

    try:
        names = run_path(str(path))
    except Exception as error:  # the file is the user's program: whatever it raises ends as one line
        raise InputError(f"'{path}' cannot be run: {type(error).__name__}: {first_line(error)}") from None
    found: Any = names.get("controller", SimpleNamespace(step=names.get("step")))
    if not callable(getattr(found, "step", None)):
        raise InputError(
            f"'{path}' has neither an object controller with step(reference, measured) nor a function step"
        )
    made: Controller = found
    return made


def close_loop(
    actuator: Actuator,
    controller: Any,
    reference: Drive,
    duration: float,
    *,
    form: str = "sampled",
    period: float | None = None,
    limit: float | None = None,
    sensor: Sensor | None = None,
    late: Late | None = None,
    pwm: tuple[float, float | None, int] | None = None,
    samples: int = _SHOWN,
    beam: str | None = None,
    load: Load | None = None,
    engine: str = "ngspice",
    op_amps: OpAmps | None = None,
    drift: Mapping[str, float] | None = None,
    adapts: bool = False,
) -> Closed:
    """Return the loop of a strip and a ``controller``: a `Tuned`, a path, a pair of law and limit, or an object.

    ``drift`` are factors that values of the strip end at, by name; a tuned PI ``adapts`` to them. ``pwm`` has a stage's
    frequency [Hz], its supply [V] if that is not the limit, and steps.

    Raises InputError for values that make no loop, SolveError for a controller that fails.
    """
    sensor, late = sensor or Sensor(), late or Late()
    if form not in FORMS:
        raise wrong_choice(argument("form"), form, FORMS)
    if isinstance(controller, str | Path):
        controller = read_controller(Path(controller))
    if isinstance(controller, Tuned):
        controller = controller.law, controller.wish.limit
    law = None
    if isinstance(controller, tuple) and len(controller) == 2 and isinstance(controller[0], Law):
        law, own = controller
        limit = own if limit is None else limit
    elif not callable(getattr(controller, "step", None)):
        raise InputError("a controller is what tune returned or wrote, or has step(reference, measured) -> voltage")
    limit = 4.0 if limit is None else limit
    _require(limit, duration, samples, sensor)
    if actuator.coupling is None:
        raise InputError(f"actuator '{actuator.name}' has no [coupling]; its tip cannot be controlled")
    times = np.linspace(0.0, duration, samples)
    net = strip_netlist(actuator, beam=beam, load=load, band=transient_band(times))
    deck, circuit, stage = "", None, None
    if op_amps is not None and form != "op-amps":
        raise InputError(f"gain-bandwidth, supply and sensor gain are of {argument('form', 'op-amps')}")
    if form != "sampled":
        if drift or adapts or pwm is not None:
            named = " and ".join(str(argument(name)) for name in ("drift", "adapt", "pwm"))
            raise InputError(f"{named} are of {argument('form', 'sampled')}")
        if law is None:
            raise InputError(f"an object with step is {argument('form', 'sampled')}; only a tuned law can be a circuit")
        if sensor != Sensor(seed=sensor.seed) or period is not None or late != Late():
            raise InputError(f"{argument('form', form)} has no period, delay, noise or quantum; take sampled")
        if form == "op-amps":
            jump = float(np.ptp(np.append(0.0, reference.value(times))))
            circuit = op_amp_controller(law, limit, jump, op_amps or OpAmps())
        whole = behavioural(net, law, limit) if circuit is None else with_op_amps(net, circuit)
        waves = run_looped(whole, reference, times)
        engine, deck = "ngspice", loop_deck(whole, reference, duration)
    else:
        if period is None:
            raise InputError(f"{argument('period')} is missing: say how often the controller is called, such as 0.1 s")
        if not (np.isfinite(period) and 0 < period <= duration):
            raise InputError(
                f"{argument('period')} is {period:g} s; it must be more than zero and at most the run's {duration:g} s"
            )
        if duration / period > _MOST_CALLS:
            raise InputError(
                f"{argument('period')} {period:g} s makes {duration / period:.3g} calls, not {_MOST_CALLS}"
            )
        if not (late.computation >= 0 and late.jitter >= 0 and late.computation + late.jitter < period):
            raise InputError(
                f"{argument('computation')} is {late.computation:g} s and {argument('jitter')} {late.jitter:g} s; "
                "neither may be negative, and together they must be shorter than the period"
            )
        called: Controller = SampledLaw(law, period, limit) if law is not None else controller
        if adapts:
            if law is None:
                raise InputError(f"{argument('adapt')} is of a controller that tune wrote; an own one adapts by itself")
            called = Adaptive(actuator, law, period, limit, beam=beam, load=load, noise=sensor.noise or NOISE)
        if engine == "exact" and not net.linear:
            raise InputError(f"the exact engine solves linear circuits only; use {argument('engine', 'ngspice')}")
        loop = (net, called, reference, period, sensor, limit, late, times)
        if pwm is not None:
            stage = _stage(limit, *pwm)
        if engine != "exact":
            if drift or stage is not None:
                raise InputError(f"{argument('drift')} and {argument('pwm')} need {argument('engine', 'exact')}")
            waves = run_ngspice(*loop)
        else:
            how: dict[str, Any] = {"beam": beam, "load": load, "band": transient_band(times)}
            moving = drifting(actuator, drift, duration, period, **how) if drift else None
            waves = run_exact(*loop, drifting=moving, stage=stage)
    return Closed(
        actuator=actuator,
        form=form,
        controller=("adaptive " if adapts else "") + _said(law, controller),
        reference=reference.value(waves.time),
        limit=limit,
        period=period,
        sensor=sensor,
        engine=engine,
        waves=waves,
        netlist=deck,
        circuit=circuit,
        drift=dict(drift or {}),
        stage=stage,
        ripple=None if stage is None else stage.ripple(plants_of(actuator, beam=beam, load=load)[0]),
        findings=(Finding("drift-unseen"),) if drift and unseen(actuator, drift) else (),
    )


def _said(law: Law | None, controller: Any) -> str:
    if law is None:
        return type(controller).__name__
    return f"{law.kind} ({', '.join(f'{name} {value:.4g}' for name, value in law.gains.items())})"


def _stage(limit: float, frequency: float, supply: float | None, steps: int) -> Pwm:
    """Return a stage, by default with the limit [V] as supply. Raises InputError for one that cannot give the limit."""
    stage = Pwm(frequency, limit if supply is None else supply, steps)
    for name, value, unit in (("pwm", stage.frequency, "Hz"), ("supply", stage.supply, "V")):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{argument(name)} is {value:g} {unit}; it must be more than zero")
    if stage.supply < limit * (1 - 1e-9):
        raise InputError(f"{argument('supply')} is {stage.supply:g} V, below the limit of the voltage, {limit:g} V")
    if not 2 <= stage.steps <= 2**24:
        raise InputError(f"{argument('duty_steps')} is {stage.steps}; give 2 to 2^24, such as 256")
    return stage


def _require(limit: float, duration: float, samples: int, sensor: Sensor) -> None:
    """Raise InputError for values that no loop has."""
    for name, value, unit in (("voltage", limit, "V"), ("duration", duration, "s")):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{argument(name)} is {value:g} {unit}; it must be more than zero")
    if not 2 <= samples <= _MOST_CALLS:
        raise InputError(f"{argument('samples')} is {samples}; give 2 to {_MOST_CALLS}")
    for name, value, unit in (
        ("delay", sensor.delay, "s"),
        ("noise", sensor.noise, "m"),
        ("quantum", sensor.quantum, "m"),
    ):
        if not (np.isfinite(value) and value >= 0):
            raise InputError(f"{argument(name)} is {value:g} {unit}; it must be zero or more")
