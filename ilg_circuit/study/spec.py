"""Specification of a sweep, its key, and its division into tasks that any process can solve.

Tasks, and therefore results, do not depend on the number of workers: the designs of one task are solved in the same
batches wherever it runs.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from ..arrays import Array, one_thread
from ..drive import PiecewiseLinear
from ..errors import InputError, argument
from ..simulation.response import sample_times
from ..strip.file import FORMAT, dumps
from .evaluate import STUDY_ACCURACY, Evaluation, Progress, evaluate, require_known, scenarios_of
from .outputs import DEFAULT_OUTPUTS, choose_outputs
from .parameters import ScenarioTemplate, require_layers
from .plan import Column, Plan, grid_plan, random_plan, read_plan

#: Designs of a task, for linear and for nonlinear circuits; largest size of its waveforms in bytes.
_DESIGNS, _DESIGNS_NONLINEAR = 256, 16
_MOST_BYTES = 32e6
#: Constants that make a strip nonlinear.
_NONLINEAR = ("emission_voltage", "capacitance_slope", "saturation_voltage", "packing_fraction")
#: Version since which the same specification gives the same numbers: an interrupted sweep of that version is resumed.
_RESULTS_OF = "0.1.0"


@dataclass(frozen=True, eq=False)
class Task:
    """Some designs of a sweep, and everything that it takes to solve them; ``how`` are arguments of `evaluate`.

    ``impossible``: number of a design -> why it is not to be solved.
    """

    template: ScenarioTemplate
    columns: dict[str, Column]
    how: dict[str, Any]
    impossible: dict[int, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def part(self, start: int, stop: int) -> Task:
        """Return the task of its designs from ``start`` up to ``stop``."""
        columns = {name: column[start:stop] for name, column in self.columns.items()}
        return replace(self, columns=columns)


def solve_task(task: Task, progress: Progress | None = None) -> Evaluation:
    """Return the outputs of a task's designs, the same wherever it runs."""
    scenarios = scenarios_of(task.template, task.columns)
    for number, reason in task.impossible.items():
        scenarios[number] = reason
    with one_thread():
        return evaluate(scenarios, progress=progress, **task.how)


@dataclass(frozen=True, eq=False)
class SweepSpec:
    """Everything that determines a sweep's result: template, plan, output names, engine, accuracy, kept waveforms.

    ``samples`` is the number of samples of each waveform. Raises InputError for unknown names and numbers out of range.
    """

    template: ScenarioTemplate
    plan: Plan
    outputs: tuple[str, ...]
    engine: str = "ngspice"
    accuracy: float = STUDY_ACCURACY
    waveforms: tuple[str, ...] = ()
    samples: int = 601

    def __post_init__(self) -> None:
        choose_outputs(self.outputs)
        require_layers(self.template.actuator, self.plan.names)
        require_known(self.engine, self.waveforms)
        if not 1e-11 <= self.accuracy <= 1e-2:
            raise InputError(f"accuracy {self.accuracy:g} must lie between 1e-11 and 1e-2")
        if isinstance(self.template.drive, str) and self.template.drive.startswith(("file:", "current:")):
            # read once and here: where tasks are solved there may be no such file
            object.__setattr__(self, "template", replace(self.template, drive=self.template.parsed_drive()))
        self.template.parsed_drive()  # raises for a text that is not a drive
        _ = self.times

    @cached_property
    def times(self) -> Array:
        """Times [s] of the waveforms' samples."""
        return sample_times(self.template.duration, samples=self.samples)

    @cached_property
    def task_size(self) -> int:
        """Designs of a task; tasks are of equal size, so that no worker is left with a long last one."""
        nonlinear = not self.template.actuator.linear or any(n in self.plan.names for n in _NONLINEAR)
        size = _DESIGNS_NONLINEAR if nonlinear else _DESIGNS
        if self.waveforms:
            size = min(size, int(_MOST_BYTES / (8 * len(self.times) * len(self.waveforms))))
        tasks = math.ceil(self.plan.count / max(size, 1))
        return math.ceil(self.plan.count / tasks)

    @property
    def task_count(self) -> int:
        return math.ceil(self.plan.count / self.task_size)

    def bounds(self, number: int) -> tuple[int, int]:
        """Return the first design of task ``number``, and the one after its last."""
        start = number * self.task_size
        return start, min(start + self.task_size, self.plan.count)

    def task(self, number: int) -> Task:
        how = {name: getattr(self, name) for name in ("outputs", "engine", "accuracy", "waveforms", "times")}
        return Task(self.template, self.plan.designs(*self.bounds(number)), how)

    @cached_property
    def key(self) -> str:
        """Digest of the whole specification: sweeps with the same key have the same result."""
        template = self.template
        drive = template.parsed_drive()
        digest = hashlib.sha256()
        run = (template.drive_text, template.duration, template.tip, template.usual_beam, template.load)
        settings = (*run, self.engine, self.accuracy)
        actuator = dumps(template.actuator).replace(f"format = {FORMAT}\n", "", 1)  # 0.1.0 had no such line
        parts: list[str | bytes] = [_RESULTS_OF, actuator]
        parts += map(repr, (settings, self.outputs, self.waveforms, self.samples, self.task_size, self.plan.grid))
        if isinstance(drive, PiecewiseLinear):
            parts += [drive.times.tobytes(), drive.values.tobytes()]
        for name, column in self.plan.columns.items():
            parts += [name, str(column.dtype), column.tobytes()]
        for part in parts:
            data = part if isinstance(part, bytes) else part.encode()
            digest.update(len(data).to_bytes(8, "little") + data)
        return digest.hexdigest()


def sweep_spec(
    template: ScenarioTemplate,
    vary: Sequence[str] = (),
    *,
    random: int | None = None,
    method: str | None = None,
    seed: int | None = None,
    designs: str | Path | None = None,
    outputs: Sequence[str] | None = None,
    waveforms: Sequence[str] = (),
    samples: int | None = None,
    **solver: Any,
) -> SweepSpec:
    """Return the specification of a grid of ``vary``, of ``random`` designs over its ranges, or of a CSV file.

    ``method`` (default lhs) and ``seed`` (default 0) are those of random designs, see `plan.random_plan`; ``samples``
    (default 601) of the kept ``waveforms``; ``solver``: ``engine`` and ``accuracy`` of `SweepSpec`. Raises InputError
    for arguments that contradict one another.
    """
    if samples is not None and not waveforms:
        raise InputError(
            f"{argument('samples')} counts the samples of waveforms; say which to keep, such as "
            f"{argument('waveforms', 'displacement')}"
        )
    for name, value in (("method", method), ("seed", seed)):
        if random is None and value is not None:
            raise InputError(f"{argument(name)} belongs to {argument('random')}; say how many random designs")
    if designs and (vary or random is not None):
        raise InputError(
            f"{argument('designs')} lists every design; leave out {argument('vary')} and {argument('random')}"
        )
    if designs:
        plan = read_plan(Path(designs))
    elif random is None:
        plan = grid_plan(vary)
    else:
        plan = random_plan(vary, random, method or "lhs", seed or 0)
    solver |= {"waveforms": tuple(waveforms), "samples": samples or 601}
    return SweepSpec(template, plan, tuple(outputs or DEFAULT_OUTPUTS), **solver)
