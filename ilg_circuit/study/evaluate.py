"""Evaluation of many scenarios: similar ones are solved in batches, failing ones are isolated.

Scenarios whose circuits have one topology, under drives that differ at most by a factor (a linear circuit's answer is
proportional to it), are solved in batches of similar time constants: by ngspice as copies in one netlist, by the exact
engine as one stack of matrices. A batch that fails is halved until the failing scenario is alone; its reason is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, ComplexArray
from ..circuit.netlist import Netlist
from ..circuit.strip import strip_netlist
from ..drive import Drive, PiecewiseLinear, Sine, drive_times
from ..errors import IlgError, InputError, MissingLibraryError
from ..simulation.response import sample_times, transient_band
from ..solve.exact import exact_on_panels
from ..solve.panels import design_panels
from ..solve.state_space import StateSpace, state_space
from ..solve.transient import fastest_modes, similar, transient
from .outputs import WAVEFORMS, BatchWaveforms, Output, choose_outputs
from .parameters import NO_LOAD, Scenario, ScenarioTemplate, Value, apply, scaled
from .piecewise import PiecewiseLegendre

Progress = Callable[[int, int], None]

ENGINES = ("ngspice", "exact", "auto")
#: Accuracy of ngspice's waveforms in a study, relative to each one's largest value.
STUDY_ACCURACY = 1e-6

#: Rounds in which panels of nonlinear circuits are subdivided, and the number of parts.
_MOST_CUTS, _CUT_INTO = 7, 4

#: Exceptions that concern one scenario only.
_FAILURES = (IlgError, ArithmeticError, np.linalg.LinAlgError)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Outputs of n scenarios: ``values`` (n, outputs), SI, NaN for failures; ``failures``: scenario -> reason.

    ``errors`` (n,): estimated error of the worst waveform relative to its maximum (0 by the exact engine).
    ``waveforms``: name -> (n, t) at ``times`` [s], for those asked for.
    """

    outputs: tuple[Output, ...]
    values: Array
    errors: Array
    failures: dict[int, str]
    times: Array
    waveforms: dict[str, Array]

    def output(self, name: str) -> Array:
        """Return one output (n,) by name."""
        return self.values[:, [o.name for o in self.outputs].index(name)]


def evaluate_designs(
    template: ScenarioTemplate, designs: Mapping[str, ArrayLike], outputs: Sequence[str] | None = None, **how: Any
) -> Evaluation:
    """Return `evaluate` for ``designs``: parameter -> values (n,), SI, as in `ilg_circuit.study.parameters.apply`.

    ``how`` are `evaluate`'s other arguments. An impossible design (a free part longer than the whole, NaN) is one
    failure among the results. Raises InputError for columns of different lengths, and as `evaluate`.
    """
    columns = {name: np.atleast_1d(np.asarray(values)).tolist() for name, values in designs.items()}
    counts = {len(column) for column in columns.values()}
    if len(counts) != 1:
        raise InputError("designs need at least one parameter, and as many values of each")
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return evaluate([_scenario(template, row) for row in rows], outputs, **how)


def _scenario(template: ScenarioTemplate, values: Mapping[str, Value]) -> Scenario | str:
    try:
        return apply(template, values)
    except _FAILURES as error:
        return _reason(error)


def evaluate(
    scenarios: Sequence[Scenario | str],
    outputs: Sequence[str] | None = None,
    *,
    engine: str = "ngspice",
    accuracy: float = STUDY_ACCURACY,
    waveforms: Sequence[str] = (),
    times: ArrayLike | None = None,
    progress: Progress | None = None,
) -> Evaluation:
    """Return the outputs of ``scenarios``; a text in place of a scenario is the reason why it is impossible.

    ``engine``: ngspice, exact (linear circuits only) or auto (exact for linear circuits). ``accuracy`` concerns
    ngspice's waveforms. ``waveforms`` (of `WAVEFORMS`) are kept at ``times`` [s], by default 601 over the longest run;
    at a jump the right limit, at the run's end the left one. ``times`` also set the band of a Warburg or CPE ladder,
    as in `simulation.response.simulate`. ``progress(done, total)`` counts scenarios. Raises InputError for unknown
    names, MissingLibraryError without ngspice.
    """
    chosen = choose_outputs(outputs)
    if engine not in ENGINES:
        raise InputError(f"engine is '{engine}'; choose one of {', '.join(ENGINES)}")
    unknown = [name for name in waveforms if name not in WAVEFORMS]
    if unknown:
        raise InputError(f"unknown waveform '{unknown[0]}'; choose from {', '.join(WAVEFORMS)}")
    longest = max((scenario.duration for scenario in scenarios if isinstance(scenario, Scenario)), default=1.0)
    samples = sample_times(longest) if times is None else np.asarray(times, dtype=np.float64)
    work = _Work(chosen, engine, accuracy, tuple(waveforms), samples, len(scenarios))
    kinds = sorted({output.blocked for output in chosen} | ({False} if waveforms else set()))
    for blocked in kinds:
        groups = work.prepare(scenarios, blocked)
        for group in groups:
            work.solve(group)
            if progress and blocked == kinds[-1]:
                work.done += len(group.members)
                progress(min(work.done, len(scenarios)), len(scenarios))
    if progress:
        progress(len(scenarios), len(scenarios))
    for k in work.failures:
        work.values[k], work.errors[k] = np.nan, np.nan
        for kept in work.waveforms.values():
            kept[k] = np.nan
    return Evaluation(chosen, work.values, work.errors, dict(sorted(work.failures.items())), samples, work.waveforms)


@dataclass(frozen=True, eq=False)
class _Batch:
    """Scenarios ``members`` solved together: netlists, linearised state space, poles, and the common ``drive``.

    ``factors`` (n,) scale ``drive`` to each scenario's own.
    """

    members: NDArray[np.intp]
    netlists: list[Netlist]
    system: StateSpace
    poles: ComplexArray
    drive: Drive
    factors: Array
    duration: float
    load_distances: Array
    tip: str
    blocked: bool

    def part(self, index: NDArray[np.intp]) -> _Batch:
        """Return the batch of some of the scenarios."""
        s = self.system
        system = StateSpace(s.a[index], s.b[index], s.c[index], s.d[index], s.output_names)
        return replace(
            self,
            members=self.members[index],
            netlists=[self.netlists[k] for k in index],
            system=system,
            poles=self.poles[index],
            factors=self.factors[index],
            load_distances=self.load_distances[index],
        )


class _Work:
    """Results of an evaluation in progress."""

    def __init__(
        self,
        outputs: tuple[Output, ...],
        engine: str,
        accuracy: float,
        waveforms: tuple[str, ...],
        times: Array,
        count: int,
    ) -> None:
        self.outputs, self.engine, self.accuracy, self.times = outputs, engine, accuracy, times
        self.values = np.full((count, len(outputs)), np.nan)
        self.errors = np.zeros(count)
        self.waveforms = {name: np.full((count, len(times)), np.nan) for name in waveforms}
        self.failures: dict[int, str] = {}
        self.done = 0

    def prepare(self, scenarios: Sequence[Scenario | str], blocked: bool) -> list[_Batch]:
        """Return batches of scenarios that can be solved together; scenarios without a circuit become failures."""
        groups: dict[Any, list[tuple[int, Netlist, Drive, float, Scenario]]] = {}
        band = transient_band(self.times)
        for k, scenario in enumerate(scenarios):
            if isinstance(scenario, str):
                self.failures[k] = scenario
            if k in self.failures or isinstance(scenario, str):
                continue
            try:
                fixed = replace(scenario, tip="clamped", load=NO_LOAD) if blocked else scenario
                netlist = strip_netlist(fixed.actuator, tip=fixed.tip, beam=fixed.beam, load=fixed.load, band=band)
                drive, factor = _normalised(fixed.drive) if netlist.linear else (fixed.drive, 1.0)
            except _FAILURES as error:
                self.failures[k] = _reason(error)
                continue
            key = (netlist.topology, _identity(drive), fixed.duration, fixed.tip)
            groups.setdefault(key, []).append((k, netlist, drive, factor, fixed))
        return [batch for group in groups.values() for batch in self._batches(group, blocked)]

    def _batches(self, group: list[tuple[int, Netlist, Drive, float, Scenario]], blocked: bool) -> list[_Batch]:
        members, netlists, drives, factors, fixed = (list(column) for column in zip(*group, strict=True))
        try:
            system = state_space([n.linearised() for n in netlists])
            poles = system.poles()
            if not netlists[0].linear:
                at_peak = state_space([n.linearised(drives[0].largest()) for n in netlists])
                poles = np.concatenate([poles, at_peak.poles()], axis=1)
        except _FAILURES as error:
            if len(group) == 1:
                self.failures[members[0]] = _reason(error)
                return []
            middle = len(group) // 2
            return [b for half in (group[:middle], group[middle:]) for b in self._batches(half, blocked)]
        whole = _Batch(
            members=np.array(members),
            netlists=netlists,
            system=system,
            poles=poles,
            drive=drives[0],
            factors=np.array(factors),
            duration=fixed[0].duration,
            load_distances=np.array([scenario.actuator.geometry.load_distance for scenario in fixed]),
            tip=fixed[0].tip,
            blocked=blocked,
        )
        return [whole.part(batch) for batch in similar(fastest_modes(system))]

    def solve(self, batch: _Batch) -> None:
        """Solve a batch; halve it until a failing scenario is alone."""
        linear = batch.netlists[0].linear
        if self.engine == "exact" and not linear:
            reason = "the exact engine solves linear circuits only, and this one is not; use ngspice or auto"
            self.failures |= dict.fromkeys(batch.members.tolist(), reason)
            return
        try:
            curves, errors = self._curves(batch)
        except MissingLibraryError:
            raise
        except _FAILURES as error:
            if len(batch.members) == 1:
                self.failures[int(batch.members[0])] = _reason(error)
                return
            for half in np.array_split(np.arange(len(batch.members)), 2):
                self.solve(batch.part(half))
            return
        panels = next(iter(curves.values())).panels
        factors = batch.factors[:, None, None]
        curves = {name: PiecewiseLegendre(panels, curve.values * factors) for name, curve in curves.items()}
        voltage = batch.drive.value(panels.points) * factors
        runs = BatchWaveforms(panels, voltage, curves, batch.tip, batch.load_distances)
        for j, output in enumerate(self.outputs):
            if output.blocked == batch.blocked:
                self.values[batch.members, j] = output.compute(runs)
        self.errors[batch.members] = np.maximum(self.errors[batch.members], errors)
        if not batch.blocked:
            inside = self.times <= batch.duration
            times = drive_times(batch.drive, self.times[inside])
            for name, kept in self.waveforms.items():
                kept[np.ix_(batch.members, inside)] = runs.curve(name).sampled(times)

    def _curves(self, batch: _Batch) -> tuple[dict[str, PiecewiseLegendre], Array]:
        """Return a batch's waveforms under its common drive, and their errors (n,).

        The poles do not show the kinks of a nonlinear law, so panels whose series does not converge are subdivided.
        """
        panels = design_panels(batch.poles, batch.drive, batch.duration)
        linear = batch.netlists[0].linear
        for cuts_left in reversed(range(1 if linear else _MOST_CUTS)):
            if linear and self.engine != "ngspice":
                solved = exact_on_panels(batch.system, batch.drive, panels)
                errors = np.zeros(len(batch.members))
            else:
                accuracy = self.accuracy if linear else max(self.accuracy / 3, 1e-11)
                waveforms = transient(
                    batch.netlists, batch.drive, panels.points.ravel(), accuracy=accuracy, interpolate=False
                )
                solved = waveforms.values.reshape(*waveforms.values.shape[:2], *panels.points.shape)
                errors = waveforms.errors.max(axis=1)
            curves = {name: PiecewiseLegendre(panels, solved[:, k]) for k, name in enumerate(batch.system.output_names)}
            if linear:
                break
            truncation = np.stack([curve.truncation for curve in curves.values()])
            unresolved = np.asarray((truncation > self.accuracy).any(axis=(0, 1)))
            errors = np.maximum(errors, truncation.max(axis=(0, 2)))
            if not (unresolved.any() and cuts_left):
                break
            panels = panels.split(unresolved, _CUT_INTO)
        return curves, errors


def _normalised(drive: Drive) -> tuple[Drive, float]:
    """Return the drive scaled to a largest value of 1 V, and the factor to scale it back."""
    if isinstance(drive, Sine) and drive.amplitude:
        return scaled(drive, 1 / drive.amplitude), drive.amplitude
    if isinstance(drive, PiecewiseLinear) and drive.largest():
        factor = float(drive.values[np.abs(drive.values).argmax()])
        return replace(drive, values=drive.values / factor), factor
    return drive, 1.0


def _identity(drive: Drive) -> Any:
    """Return a value that is equal for drives that are the same function of time."""
    if isinstance(drive, PiecewiseLinear):
        return drive.times.tobytes(), drive.values.round(13).tobytes()
    return drive


def _reason(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, IlgError) else f"values out of all proportion ({text or type(error).__name__})"
