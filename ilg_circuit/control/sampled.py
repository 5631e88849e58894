"""The loop with a sampled controller: any object with ``step(reference, measured) -> voltage``, in either engine.

The controller is called at multiples of its period. What it is given was measured earlier by the sensor's delay, with
noise, in steps; its voltage is held from the computation's delay on. The exact engine carries the strip's states from
one of these times to the next by matrix exponentials; ngspice stops at them within one transient.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

import numpy as np
from scipy.linalg import expm

from ..arrays import Array
from ..circuit.netlist import Netlist, copies
from ..drive import Drive
from ..errors import IlgError, SolveError, first_line
from ..solve.state_space import state_space
from .drift import Drifting
from .laws import Law
from .pwm import Pwm, Switched

#: Time after a change of the voltage at which ngspice has a point, in periods: without it the error is first order.
_JUST_AFTER = 1e-6
#: Times that are one, in periods.
_ROUNDING = 1e-9
#: Steps of ngspice between two times, at first and at most, and the error accepted, of the largest displacement.
_FIRST, _MOST, ACCURACY = 8, 512, 1e-6


class Controller(Protocol):
    """What is called at every sample."""

    def step(self, reference: float, measured: float) -> float:
        """Return the voltage [V] for a reference and a measured displacement [m]."""


class SampledLaw:
    """A law sampled with a ``period`` [s]: its states follow exactly what is held, the voltage applied included."""

    def __init__(self, law: Law, period: float, limit: float) -> None:
        self.law, self.period, self.limit = law, period, limit
        n = len(law.out)
        whole = np.zeros((n + 3, n + 3))
        # x' = A x + b_r r + b_y y + b_s (u - c x - d_r r - d_y y), so that u is what the strip has, not what changes
        whole[:n, :n] = law.a - np.outer(law.into_excess, law.out)
        whole[:n, n] = law.into_reference - law.into_excess * law.reference
        whole[:n, n + 1] = law.into_measured - law.into_excess * law.measured
        whole[:n, n + 2] = law.into_excess
        moved = expm(whole * period)
        self.a, self.b = moved[:n, :n], moved[:n, n:]
        self.state = np.zeros(n)

    def step(self, reference: float, measured: float) -> float:
        """Return the limited voltage [V], and go on by a period."""
        asked = float(self.law.out @ self.state) + self.law.reference * reference + self.law.measured * measured
        voltage = min(max(asked, -self.limit), self.limit)
        self.state = self.a @ self.state + self.b @ np.array([reference, measured, voltage])
        if self.law.clamps:
            self.state[0] = min(max(self.state[0], -self.limit), self.limit)
        return voltage


@dataclass(frozen=True)
class Sensor:
    """A displacement sensor: ``delay`` [s], ``noise`` (standard deviation [m]) from a ``seed``, ``quantum`` [m]."""

    delay: float = 0.0
    noise: float = 0.0
    quantum: float = 0.0
    seed: int = 0


@dataclass(frozen=True)
class Late:
    """How long after its call a voltage comes: ``computation`` [s], and up to ``jitter`` [s] more, by chance."""

    computation: float = 0.0
    jitter: float = 0.0


@dataclass(frozen=True, eq=False)
class Waves:
    """A sampled run at ``time`` [s] (n,), its displacement [m], current [A] and voltage [V], and the samples (k,).

    ``estimates`` (k,) are what the controller says of the strip, by name, if it does.
    """

    time: Array
    displacement: Array
    current: Array
    voltage: Array
    sampled: Array
    measured: Array
    error: float
    estimates: Mapping[str, Array] = field(default_factory=dict)


class _Loop:
    """What happens at which time: measuring, calling the controller, changing the voltage."""

    def __init__(
        self,
        controller: Controller,
        reference: Drive,
        period: float,
        sensor: Sensor,
        limit: float,
        late: Late,
        outputs: Array,
    ) -> None:
        duration = float(outputs[-1])
        calls = int(np.floor(duration / period * (1 + 1e-12))) + 1
        samples: Array = np.asarray(np.arange(calls) * period, dtype=np.float64)
        random = np.random.default_rng(sensor.seed)
        self.noise = sensor.noise * random.standard_normal(len(samples))
        seen, changed = samples - sensor.delay, samples + late.computation
        if late.jitter:
            changed = changed + late.jitter * random.random(len(samples))
        changed = changed[changed < duration * (1 - _ROUNDING)]
        times = np.concatenate([samples, seen[seen > 0], changed, outputs])
        times = np.sort(times)
        self.times = times[np.append(True, np.diff(times) > _ROUNDING * period)]
        self.samples, self.period = samples, period

        def places(wanted: Array) -> dict[int, int]:
            """Return place in the times -> number, for those that are among them."""
            at = np.clip(np.searchsorted(self.times, wanted - 2 * _ROUNDING * period), 0, len(self.times) - 1)
            near = np.abs(self.times[at] - wanted) <= 4 * _ROUNDING * period
            return {int(j): k for k, (j, good) in enumerate(zip(at, near, strict=True)) if good}

        self.seen, self.called, self.changed = places(seen), places(samples), places(changed)
        self.shown = np.array(sorted(places(outputs)), dtype=int)
        self.controller = copy.deepcopy(controller)
        self.references = reference.value(samples)
        self.quantum, self.limit = sensor.quantum, limit
        self.exact = np.zeros(len(samples))
        self.measured = np.zeros(len(samples))
        self.wanted = np.zeros(len(samples))
        self.voltage = 0.0

    def arrive(self, place: int, displacement: Callable[[], float]) -> float:
        """Return the voltage from a place of the times on. Raises SolveError for a controller that fails."""
        if place in self.seen:
            self.exact[self.seen[place]] = displacement()
        if place in self.called:
            k = self.called[place]
            value = self.exact[k] + self.noise[k]
            if self.quantum:
                value = self.quantum * round(value / self.quantum)
            self.measured[k] = value
            self.wanted[k] = self._called(float(self.references[k]), float(value), float(self.samples[k]))
        if place in self.changed:
            self.voltage = float(self.wanted[self.changed[place]])
        return self.voltage

    def _called(self, reference: float, measured: float, time: float) -> float:
        try:
            voltage = float(self.controller.step(reference, measured))
        except IlgError:
            raise
        except Exception as error:  # the code is the user's: whatever it raises ends as one line
            kind, said = type(error).__name__, first_line(error)
            raise SolveError(f"the controller's step raised {kind} at {time:g} s: {said}") from None
        if not np.isfinite(voltage):
            raise SolveError(f"the controller's step returned {voltage} at {time:g} s; it must be a finite voltage")
        return min(max(voltage, -self.limit), self.limit)


def run_exact(net: Netlist, *loop: Any, drifting: Drifting | None = None, stage: Pwm | None = None) -> Waves:
    """Return the run of a linear strip, or of one that drifts; ``loop`` is what `run_ngspice` has after the netlist.

    With a ``stage`` the voltage switches; voltages and currents that are returned are then means over a cycle.
    """
    events = _Loop(*loop)
    system = state_space([net]) if drifting is None else drifting.system
    starts = np.zeros(1) if drifting is None else drifting.starts
    y, i = (system.output_names.index(name) for name in ("displacement", "current"))
    n = system.a.shape[1]
    whole = np.zeros((len(starts), n + 1, n + 1))
    whole[:, :n, :n], whole[:, :n, n] = system.a, system.b[:, :, 0]
    known: dict[tuple[int, float], Array] = {}
    x = np.zeros(n)
    found = np.zeros((len(events.times), 3))
    held = np.searchsorted(starts, events.times + _ROUNDING * events.period, "right") - 1
    before, switched = 0, [] if stage is None else [Switched(stage, one) for one in whole]
    for place, (time, k) in enumerate(zip(events.times.tolist(), held.tolist(), strict=True)):
        if drifting is not None and k != before:
            if stage is not None:
                switched[k].mean = switched[before].mean
            x, before = x * drifting.jumps[k], k
        c, d = system.c[k], system.d[k, :, 0]
        at = float(c[y] @ x)
        u = events.arrive(place, partial(float, at))
        if stage is not None:
            u = stage.mean(u)
        found[place] = at, float(c[i] @ x + d[i] * u), u
        if stage is not None and place + 1 < len(events.times):
            x = switched[k].moved(x, time, float(events.times[place + 1]), u)
        elif place + 1 < len(events.times):
            width = round(float(events.times[place + 1]) - time, 14)
            if (k, width) not in known:
                known[k, width] = expm(whole[k] * width)
            x = known[k, width][:n, :n] @ x + known[k, width][:n, n] * u
    return _waves(events, found, 0.0)


def run_ngspice(
    net: Netlist,
    controller: Controller,
    reference: Drive,
    period: float,
    sensor: Sensor,
    limit: float,
    late: Late,
    outputs: Array,
) -> Waves:
    """Return the run by ngspice with the controller called within the transient, to `ACCURACY`.

    ``outputs`` [s] (n,) are the times that are returned. The steps are halved until the displacement moves by less than
    that; noise and steps of the sensor are the same in every run. Raises SolveError where it is not reached.
    """
    loop = (controller, reference, period, sensor, limit, late, outputs)
    parts, before = _FIRST, None
    while parts <= _MOST:
        waves = _transient(net, _Loop(*loop), parts, period)
        if before is not None:
            moved = float(np.abs(waves.displacement - before.displacement).max())
            error = moved / 3 / max(float(np.abs(waves.displacement).max()), 1e-300)
            if error <= ACCURACY:
                return Waves(**{**vars(waves), "error": error})
        before, parts = waves, 2 * parts
    if sensor.quantum:  # a reading on an edge of a step may fall to either side, which no finer step changes
        return Waves(**{**vars(waves), "error": error})
    raise SolveError(f"ngspice's sampled loop moves by {error:.1e} of its largest displacement, not {ACCURACY:g}")


def _transient(net: Netlist, events: _Loop, parts: int, period: float) -> Waves:
    """Return one run of ngspice with every interval in ``parts``."""
    from ..solve.ngspice import session

    text, (vectors,) = copies([net])
    quantities = list(vectors)
    terms = {output.name: output.terms for output in net.outputs}
    grid, places = [0.0], {0: 0}
    for place, (start, end) in enumerate(zip(events.times[:-1].tolist(), events.times[1:].tolist(), strict=True)):
        just = [start + _JUST_AFTER * period] if place in events.changed else []
        first = just[0] if just else start
        grid += [*just, *np.linspace(first, end, parts + 1)[1:].tolist()]
        places[len(grid) - 1] = place + 1
    held = np.zeros(len(grid))
    names = [vectors[q] for q in quantities]
    own = f"{text}\n{net.source.line('external')}"
    at_start = events.arrive(0, lambda: 0.0)
    applied = np.zeros(len(events.times))
    applied[0] = at_start

    with session().loaded(own, grid[-1], names, linear=net.linear) as run:

        def arrived(position: int, read: Callable[[str], float]) -> float:
            if position and position in places:
                applied[places[position]] = events.arrive(
                    places[position], lambda: sum(k * read(vectors[q]) for q, k in terms["displacement"])
                )
            return events.voltage

        values = run(np.array(grid), held, arrived)
    whole = np.concatenate([np.zeros((len(names), 1)), values], axis=1)
    at = np.array(list(places), dtype=int)
    found = np.zeros((len(events.times), 3))
    for column, name in enumerate(("displacement", "current")):
        found[:, column] = sum(k * whole[quantities.index(q), at] for q, k in terms[name])
    # currents just after a change of the voltage, as the exact engine has them
    for place in events.changed:
        if place + 1 < len(events.times):
            position = int(at[place]) + 1
            found[place, 1] = sum(k * whole[quantities.index(q), position] for q, k in terms["current"])
    found[:, 2] = applied
    return _waves(events, found, np.inf)


def _waves(events: _Loop, found: Array, error: float) -> Waves:
    shown = found[events.shown]
    displacement, current, voltage = shown.T
    times, samples = events.times[events.shown], events.samples
    return Waves(times, displacement, current, voltage, samples, events.measured, error, _estimates(events))


def _estimates(events: _Loop) -> dict[str, Array]:
    """Return what the controller has in ``estimates``: a number for each call, by name."""
    said = getattr(events.controller, "estimates", None)
    if not isinstance(said, Mapping):
        return {}
    rows = {str(name): np.asarray(values) for name, values in said.items()}
    shape = events.samples.shape
    return {name: row.astype(float) for name, row in rows.items() if row.shape == shape and row.dtype.kind in "fi"}
