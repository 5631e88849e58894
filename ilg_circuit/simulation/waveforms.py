"""The registry of the waveforms that a simulation gives: one entry each.

An entry is all that there is to add: `Response`, its CSV file, text, picture and checks, the band of a prediction, and
what a study can keep go through `WAVEFORMS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Array
from ..drive import Drive, by_current, levels, voltage_limit
from ..result import Column, Result
from ..solve.transient import Waveforms
from ..strip.actuator import Actuator


@dataclass(frozen=True)
class Solution:
    """A solved run: the solver's ``waveforms`` under the ``drive`` at ``time`` [s] (n,)."""

    drive: Drive
    time: Array
    waveforms: Waveforms

    def sampled(self, output: str) -> Array:
        """Return an output or a work (n,); NaN where the netlist does not have it."""
        if output not in self.waveforms.names:
            return np.full(len(self.time), np.nan)
        return self.waveforms.output(output)


@dataclass(frozen=True)
class Waveform:
    """One waveform; ``name`` is its attribute of `Response` and its name everywhere, ``unit`` its SI unit.

    A mechanical one is NaN where the actuator has no coupling. It is the solve's output of the same name, or what
    ``compute`` makes of the solution. ``place`` says where it is taken, for tables of what there is. ``on_request``:
    in a CSV file only if asked for.
    """

    name: str
    unit: str
    domain: Literal["electrical", "mechanical", "energy"]
    place: str = ""
    compute: Callable[[Solution], Array] | None = None
    on_request: bool = False

    @property
    def column(self) -> str:
        """Its header in a CSV file, such as current_A."""
        return f"{self.name}_{self.unit}"

    def of(self, solution: Solution) -> Array:
        """Return the waveform (n,) of a solution."""
        return self.compute(solution) if self.compute else solution.sampled(self.name)


def _voltage(solution: Solution) -> Array:
    """Return the voltage (n,): the (first) drive itself, or of a drive by current the solve's output."""
    return solution.sampled("voltage") if by_current(solution.drive) else levels(solution.drive, solution.time)[0]


#: Every waveform by name, in the order of the columns of a CSV file. The drive comes first.
WAVEFORMS = {
    waveform.name: waveform
    for waveform in (
        Waveform("voltage", "V", "electrical", compute=_voltage),
        Waveform("current", "A", "electrical"),
        Waveform("displacement", "m", "mechanical", place="of L_F"),
        Waveform("force", "N", "mechanical", place="on load or clamp"),
        Waveform("charge", "C", "electrical"),
        Waveform("energy", "J", "energy", on_request=True),
    )
}


@dataclass(frozen=True, repr=False, eq=False)
class Simulated(Result):
    """Waveforms of an ``actuator`` at ``time`` [s] (n,): ``waveforms`` [SI], each (n,) and an attribute of its name.

    ``error`` is the estimated error of the worst waveform relative to its maximum, ``engine`` what solved it.
    """

    actuator: Actuator
    time: Array
    waveforms: Mapping[str, Array]
    error: float
    engine: str

    def __getattr__(self, name: str) -> Array:
        if name in WAVEFORMS and name in self.waveforms:
            return self.waveforms[name]
        raise self._missing(name, f"its waveforms are {', '.join(vars(self).get('waveforms', ()))}")

    def table(self) -> tuple[Column, ...]:
        """Return time and waveforms (n,)."""
        waves = (Column(name, values, WAVEFORMS[name].unit) for name, values in self.waveforms.items())
        return (Column("time", self.time, "s", over=True), *waves)


#: Waveforms of the response, i.e. all except the drive; electrical ones first, as in pictures and checks.
ANSWERS = tuple(
    sorted(
        (waveform for waveform in WAVEFORMS.values() if waveform.name != "voltage"),
        key=lambda waveform: ("electrical", "mechanical", "energy").index(waveform.domain),
    )
)


def answers(drive: Drive) -> tuple[Waveform, ...]:
    """Return the waveforms that answer a ``drive``: all except it, see `ANSWERS`; of a source with a limit all."""
    if not by_current(drive):
        return ANSWERS
    given = voltage_limit(drive) is None
    others = (waveform for waveform in ANSWERS if not (given and waveform.name == "current"))
    return (WAVEFORMS["voltage"], *others)
