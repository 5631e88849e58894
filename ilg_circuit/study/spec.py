"""A sweep's complete spec, its key, and its division into tasks that any process anywhere can solve.

Tasks do not depend on how many workers there are, so neither do results: the designs of one task are solved in the same
batches wherever it runs.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from functools import cached_property

from .. import __version__
from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import InputError
from ..simulation.response import sample_times
from ..strip.file import dumps
from .evaluate import ENGINES, STUDY_ACCURACY, Evaluation, Progress, evaluate_designs
from .outputs import WAVEFORMS, choose_outputs
from .parameters import ScenarioTemplate
from .plan import Column, Plan
from .threads import one_thread

#: Designs of a task, where circuits are linear and where they are not; and the most bytes that its waveforms may take.
_DESIGNS, _DESIGNS_NONLINEAR = 256, 16
_MOST_BYTES = 32e6
#: Varied, these make a linear strip nonlinear.
_NONLINEAR = ("emission_voltage", "capacitance_slope")


@dataclass(frozen=True, eq=False)
class Task:
    """Some designs of a spec, and all that it takes to solve them."""

    template: ScenarioTemplate
    columns: dict[str, Column]
    outputs: tuple[str, ...]
    engine: str
    accuracy: float
    waveforms: tuple[str, ...]
    times: Array

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def part(self, start: int, stop: int) -> Task:
        """Its designs from ``start`` up to ``stop``."""
        columns = {name: column[start:stop] for name, column in self.columns.items()}
        return replace(self, columns=columns)


def solve_task(task: Task, progress: Progress | None = None) -> Evaluation:
    """The outputs of a task's designs, the same wherever it runs."""
    with one_thread():
        return evaluate_designs(
            task.template,
            task.columns,
            task.outputs,
            engine=task.engine,
            accuracy=task.accuracy,
            waveforms=task.waveforms,
            times=task.times,
            progress=progress,
        )


@dataclass(frozen=True, eq=False)
class SweepSpec:
    """All that decides a sweep's result: template, designs, outputs (names), how solved, and waveforms kept.

    ``samples`` is the number of samples of each waveform. Raises InputError for unknown words or numbers out of range.
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
        if self.engine not in ENGINES:
            raise InputError(f"engine is '{self.engine}'; choose one of {', '.join(ENGINES)}")
        if not 1e-11 <= self.accuracy <= 1e-2:
            raise InputError(f"accuracy {self.accuracy:g} must lie between 1e-11 and 1e-2")
        unknown = [name for name in self.waveforms if name not in WAVEFORMS]
        if unknown:
            raise InputError(f"unknown waveform '{unknown[0]}'; choose from {', '.join(WAVEFORMS)}")
        if isinstance(self.template.drive, str) and self.template.drive.startswith("file:"):
            # read once and here: where tasks are solved there may be no such file
            object.__setattr__(self, "template", replace(self.template, drive=self.template.parsed_drive()))
        self.template.parsed_drive()  # a text that is no drive is the spec's fault
        _ = self.times

    @cached_property
    def times(self) -> Array:
        """Times [s] of the waveforms' samples."""
        return sample_times(self.template.duration, samples=self.samples)

    @cached_property
    def task_size(self) -> int:
        """Designs of a task: as many in each as can be, so that no worker is left with a long last one."""
        material = self.template.actuator.material
        nonlinear = any(getattr(material, n) or n in self.plan.names for n in _NONLINEAR)
        size = _DESIGNS_NONLINEAR if nonlinear else _DESIGNS
        if self.waveforms:
            size = min(size, int(_MOST_BYTES / (8 * len(self.times) * len(self.waveforms))))
        tasks = math.ceil(self.plan.count / max(size, 1))
        return math.ceil(self.plan.count / tasks)

    @property
    def task_count(self) -> int:
        return math.ceil(self.plan.count / self.task_size)

    def bounds(self, number: int) -> tuple[int, int]:
        """First design of task ``number``, and the one after its last."""
        start = number * self.task_size
        return start, min(start + self.task_size, self.plan.count)

    def task(self, number: int) -> Task:
        columns = self.plan.designs(*self.bounds(number))
        return Task(self.template, columns, self.outputs, self.engine, self.accuracy, self.waveforms, self.times)

    @cached_property
    def key(self) -> str:
        """A digest of the whole spec: two questions with the same key have the same answer."""
        template = self.template
        drive = template.parsed_drive()
        digest = hashlib.sha256()
        settings = (
            template.drive_text,
            template.duration,
            template.tip,
            template.beam,
            template.load,
            self.engine,
            self.accuracy,
        )
        for part in (
            __version__,
            dumps(template.actuator),
            *map(repr, (settings, self.outputs, self.waveforms, self.samples, self.task_size, self.plan.grid)),
            *((drive.times.tobytes(), drive.values.tobytes()) if isinstance(drive, PiecewiseLinear) else ()),
            *(
                item
                for name, column in self.plan.columns.items()
                for item in (name, str(column.dtype), column.tobytes())
            ),
        ):
            data = part if isinstance(part, bytes) else part.encode()
            digest.update(len(data).to_bytes(8, "little") + data)
        return digest.hexdigest()
