"""Evaluation of many scenarios: similar ones are solved in batches, failing ones are isolated.

Scenarios whose circuits have one topology, under drives that differ at most by a factor (a linear circuit's answer is
proportional to it), are solved in batches of similar time constants: by ngspice as copies in one netlist, by the exact
engine as one stack of matrices. A batch that fails is halved until the failing scenario is alone; its reason is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, ComplexArray
from ..circuit.netlist import Netlist
from ..circuit.strip import strip_netlist
from ..drive import Drive, PiecewiseLinear, Sine, by_current, drive_times
from ..errors import IlgError, InputError, MissingLibraryError, wrong_choice
from ..simulation.response import sample_times, transient_band
from ..solve.exact import exact_on_panels
from ..solve.modes import fastest_modes, similar
from ..solve.panels import design_panels
from ..solve.state_space import StateSpace, state_space
from ..solve.transient import transient
from ..strip.changes import Value
from .outputs import WAVEFORMS, BatchWaveforms, Output, choose_outputs
from .parameters import NO_LOAD, Scenario, ScenarioTemplate, apply, scaled
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
    columns = {name: np.atleast_1d(np.asarray(values)) for name, values in designs.items()}
    if len({len(column) for column in columns.values()}) != 1:
        raise InputError("designs need at least one parameter, and as many values of each")
    return evaluate(scenarios_of(template, columns), outputs, **how)


def scenarios_of(
    template: ScenarioTemplate, columns: Mapping[str, NDArray[Any]], fixed: dict[str, Value] | None = None
) -> list[Scenario | str]:
    """Return the scenarios of designs, parameter -> values (n,), or the reasons why they are impossible.

    ``fixed`` values are shared by all of them.
    """
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [scenario_of(template, (fixed or {}) | dict(zip(columns, row, strict=True))) for row in rows]


def scenario_of(template: ScenarioTemplate, values: Mapping[str, Value]) -> Scenario | str:
    """Return the scenario of one design, or the reason why it is impossible."""
    try:
        return apply(template, values)
    except _FAILURES as error:
        return _reason(error)


def require_known(engine: str, waveforms: Iterable[str]) -> None:
    """Raise InputError for an engine or a waveform that a study does not have."""
    if engine not in ENGINES:
        raise wrong_choice("engine", engine, ENGINES)
    for name in waveforms:
        if name not in WAVEFORMS:
            raise InputError(f"unknown waveform '{name}'; choose from {', '.join(WAVEFORMS)}")


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
    require_known(engine, waveforms)
    longest = max((scenario.duration for scenario in scenarios if isinstance(scenario, Scenario)), default=1.0)
    samples = sample_times(longest) if times is None else np.asarray(times, dtype=np.float64)
    count, done = len(scenarios), 0
    result = Evaluation(
        outputs=chosen,
        values=np.full((count, len(chosen)), np.nan),
        errors=np.zeros(count),
        failures={k: scenario for k, scenario in enumerate(scenarios) if isinstance(scenario, str)},
        times=samples,
        waveforms={name: np.full((count, len(samples)), np.nan) for name in waveforms},
    )
    work = _Work(result, engine, accuracy)
    kinds = sorted({output.blocked for output in chosen} | ({False} if waveforms else set()))
    for blocked in kinds:
        for batch in work.batches(scenarios, blocked):
            work.solve(batch)
            if progress and blocked == kinds[-1]:
                done += len(batch.members)
                progress(min(done, count), count)
    if progress:
        progress(count, count)
    failed = sorted(result.failures)
    for array in (result.values, result.errors, *result.waveforms.values()):
        array[failed] = np.nan
    return replace(result, failures={k: result.failures[k] for k in failed})


@dataclass(frozen=True)
class _Member:
    """A scenario, number ``index`` of the evaluation, as it is solved; ``factor`` scales ``drive`` to its own."""

    index: int
    scenario: Scenario
    netlist: Netlist
    drive: Drive
    factor: float


@dataclass(frozen=True, eq=False)
class _Batch:
    """Scenarios solved together, with their linearised state space and poles; the drive is the first one's."""

    members: Sequence[_Member]
    system: StateSpace
    poles: ComplexArray
    blocked: bool

    def part(self, index: NDArray[np.intp]) -> _Batch:
        """Return the batch of some of the scenarios."""
        s = self.system
        system = StateSpace(s.a[index], s.b[index], s.c[index], s.d[index], s.output_names)
        return _Batch([self.members[k] for k in index], system, self.poles[index], self.blocked)


@dataclass(frozen=True, eq=False)
class _Work:
    """An evaluation in progress; ``result`` is filled batch by batch."""

    result: Evaluation
    engine: str
    accuracy: float

    def batches(self, scenarios: Sequence[Scenario | str], blocked: bool) -> list[_Batch]:
        """Return batches of scenarios that can be solved together; scenarios without a circuit become failures."""
        groups: dict[Any, list[_Member]] = {}
        band = transient_band(self.result.times)
        for k, scenario in enumerate(scenarios):
            if isinstance(scenario, str) or k in self.result.failures:
                continue
            try:
                fixed = replace(scenario, tip="clamped", load=NO_LOAD) if blocked else scenario
                how: dict[str, Any] = {"tip": fixed.tip, "beam": fixed.beam, "load": fixed.load, "band": band}
                netlist = strip_netlist(fixed.actuator, **how, by_current=by_current(fixed.drive))
                drive, factor = _normalised(fixed.drive) if netlist.linear else (fixed.drive, 1.0)
            except _FAILURES as error:
                self.result.failures[k] = _reason(error)
                continue
            key = (netlist.topology, _identity(drive), fixed.duration, fixed.tip)
            groups.setdefault(key, []).append(_Member(k, fixed, netlist, drive, factor))
        return [batch for group in groups.values() for batch in self._batches(group, blocked)]

    def _batches(self, group: Sequence[_Member], blocked: bool) -> list[_Batch]:
        netlists = [member.netlist for member in group]
        try:
            system = state_space([n.linearised() for n in netlists])
            poles = system.poles()
            if not netlists[0].linear:
                at_peak = state_space([n.linearised(n.voltage_at(group[0].drive.largest())) for n in netlists])
                poles = np.concatenate([poles, at_peak.poles()], axis=1)
        except _FAILURES as error:
            if len(group) == 1:
                self.result.failures[group[0].index] = _reason(error)
                return []
            middle = len(group) // 2
            return [b for half in (group[:middle], group[middle:]) for b in self._batches(half, blocked)]
        whole = _Batch(group, system, poles, blocked)
        return [whole.part(batch) for batch in similar(fastest_modes(system))]

    def solve(self, batch: _Batch) -> None:
        """Solve a batch; halve it until a failing scenario is alone."""
        result, first = self.result, batch.members[0]
        index = np.array([member.index for member in batch.members])
        if self.engine == "exact" and not first.netlist.linear:
            reason = "the exact engine solves linear circuits only, and this one is not; use ngspice or auto"
            result.failures.update(dict.fromkeys(index.tolist(), reason))
            return
        try:
            curves, errors = self._curves(batch)
        except MissingLibraryError:
            raise
        except _FAILURES as error:
            if len(index) == 1:
                result.failures[first.index] = _reason(error)
                return
            for half in np.array_split(np.arange(len(index)), 2):
                self.solve(batch.part(half))
            return
        panels = next(iter(curves.values())).panels
        factors = np.array([member.factor for member in batch.members])[:, None, None]
        distances = np.array([member.scenario.actuator.geometry.load_distance for member in batch.members])
        curves = {name: PiecewiseLegendre(panels, curve.values * factors) for name, curve in curves.items()}
        runs = BatchWaveforms(panels, first.drive.value(panels.points) * factors, curves, first.scenario.tip, distances)
        for j, output in enumerate(result.outputs):
            if output.blocked == batch.blocked:
                result.values[index, j] = output.compute(runs)
        result.errors[index] = np.maximum(result.errors[index], errors)
        if not batch.blocked:
            inside = result.times <= first.scenario.duration
            times = drive_times(first.drive, result.times[inside])
            for name, kept in result.waveforms.items():
                kept[np.ix_(index, inside)] = runs.curve(name).sampled(times)

    def _curves(self, batch: _Batch) -> tuple[dict[str, PiecewiseLegendre], Array]:
        """Return a batch's waveforms under its common drive, and their errors (n,).

        The poles do not show the kinks of a nonlinear law, so panels whose series does not converge are subdivided.
        """
        first, netlists = batch.members[0], [member.netlist for member in batch.members]
        linear = first.netlist.linear
        panels = design_panels(batch.poles, first.drive, first.scenario.duration)
        for cuts_left in reversed(range(1 if linear else _MOST_CUTS)):
            if linear and self.engine != "ngspice":
                solved = exact_on_panels(batch.system, first.drive, panels)
                errors = np.zeros(len(netlists))
            else:
                accuracy = self.accuracy if linear else max(self.accuracy / 3, 1e-11)
                waveforms = transient(
                    netlists, first.drive, panels.points.ravel(), accuracy=accuracy, interpolate=False
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
    return text if isinstance(error, IlgError) else f"implausible values ({text or type(error).__name__})"
