"""The search space: ranges of parameters mapped to a unit cube, and the quantities of every design in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..errors import InputError, argument
from ..solve.library import chosen_engine
from ..strip.changes import Value
from ..strip.models.ladder_path import LadderPath
from .evaluate import Evaluation, evaluate, scenario_of, scenarios_of
from .parameters import Scenario, ScenarioTemplate
from .plan import Range, parse_each
from .requirements import Designs, Quantity

#: Sobol points that a search evaluates first; of a ladder, whose circuit is large, half as many for each range less
#: than so many.
INITIAL_POINTS = {"exact": 1024, "ngspice": 64}
_ALL_FROM = 4
#: Called with the number of designs simulated since the last call.
Counter = Callable[[int], None]


def uncounted(count: int) -> None:
    """Count nothing."""


#: Digits to which a design's sizes are rounded, so that the printed sizes are the simulated ones.
_DIGITS = 6
#: Number of designs tried between the lower and the upper ends of all ranges, one of which must be possible.
_TRIED = 33


def parse_ranges(texts: Sequence[str]) -> tuple[tuple[Range, ...], dict[str, Value]]:
    """Parse texts such as ``thickness=0.2mm:1mm`` into ranges (logarithmic where positive), ``width=5mm`` into values.

    Raises InputError for a text that is not understood, a parameter given twice, and where no range is given.
    """
    ranges: list[Range] = []
    fixed: dict[str, Value] = {}
    for interval in parse_each(texts):
        name, text = interval.parameter.name, interval.text[:60]
        if interval.count is not None or len(interval.values) > 1:
            raise InputError(f"'{text}': a design is looked for in a whole range; write it like {name}=from:to")
        if interval.values:
            fixed[name] = interval.values[0]
        else:
            ranges.append(replace(interval, log=interval.low > 0))
    if not ranges:
        example = argument("vary", "thickness=0.2mm:1mm")
        raise InputError(f"nothing is left to choose; give a range, such as {example}")
    return tuple(ranges), fixed


@dataclass(frozen=True, eq=False)
class Space:
    """The unit cube of designs of ``template``: coordinate j of a point (n,) is the position within ``ranges[j]``.

    ``fixed`` values are shared by all designs. ``engine``: exact or ngspice. ``count`` is called after simulations.
    """

    template: ScenarioTemplate
    ranges: tuple[Range, ...]
    fixed: dict[str, Value]
    engine: str
    count: Counter = uncounted

    def __getstate__(self) -> dict[str, Any]:
        """Return the pickled state: all but the counter."""
        return self.__dict__ | {"count": uncounted}

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(interval.parameter.name for interval in self.ranges)

    @property
    def scattered(self) -> int:
        """Number of designs, scattered over the ranges, that a search begins with."""
        ladder = self.engine == "exact" and isinstance(self.template.actuator.material.model.ions, LadderPath)
        fewer = max(_ALL_FROM - len(self.ranges), 0) if ladder else 0
        return max(INITIAL_POINTS[self.engine] >> fewer, 1)

    def columns(self, points: Array) -> dict[str, Array]:
        """Return the values (k,) [SI] of each parameter at ``points`` (k, n)."""
        return {
            r.parameter.name: np.clip(np.asarray(r.at(points[:, j]), dtype=float), r.low, r.high)
            for j, r in enumerate(self.ranges)
        }

    def point(self, values: dict[str, float]) -> Array:
        """Return the point (n,) of a design, clipped to the ranges."""
        shares = []
        for r in self.ranges:
            x = min(max(values[r.parameter.name], r.low), r.high)
            shares.append(np.log(x / r.low) / np.log(r.high / r.low) if r.log else (x - r.low) / (r.high - r.low))
        return np.array(shares).clip(0.0, 1.0)

    def values(self, point: Array) -> dict[str, float]:
        """Return the values [SI] of each parameter at one ``point`` (n,)."""
        return {name: float(column[0]) for name, column in self.columns(point[None]).items()}

    def rounded(self, point: Array) -> dict[str, float]:
        """Return the design at ``point`` (n,) with values rounded to six digits, within the ranges."""
        return {
            name: min(max(float(f"{x:.{_DIGITS}g}"), r.low), r.high)
            for (name, x), r in zip(self.values(point).items(), self.ranges, strict=True)
        }

    def scenario(self, values: dict[str, float]) -> Scenario | str:
        """Return the scenario of a design, or the reason why it is impossible."""
        return scenario_of(self.template, {**self.fixed, **values})

    def measure(
        self, columns: dict[str, Array], quantities: Iterable[Quantity], engine: str | None = None
    ) -> tuple[dict[str, Array], Evaluation]:
        """Return `measure` for the designs of ``columns``, parameter -> values (k,), by default with its own engine."""
        scenarios = scenarios_of(self.template, columns, self.fixed)
        return measure(scenarios, columns, quantities, engine or self.engine)

    def referee(self) -> str:
        """Return the engine that simulates the answer once more: ngspice, or where it is missing, the space's own."""
        return chosen_engine(None, linear=self.engine == "exact")

    def at(self, points: Array, quantities: Iterable[Quantity]) -> dict[str, Array]:
        """Return each quantity's values (k,) at ``points`` (k, n); NaN for designs that fail."""
        self.count(len(points))
        return self.measure(self.columns(points), quantities)[0]

    def evaluate(self, points: Array, quantities: Iterable[Quantity]) -> Array:
        """Return the values of `at` as a table (k, q)."""
        return np.column_stack(list(self.at(points, quantities).values()))


def measure(
    scenarios: Sequence[Scenario | str], columns: dict[str, Array], quantities: Iterable[Quantity], engine: str
) -> tuple[dict[str, Array], Evaluation]:
    """Return each quantity's values (k,) for ``scenarios``, NaN for failures, and the evaluation they come from."""
    wanted = list(quantities)
    outputs = tuple(dict.fromkeys(name for q in wanted for name in q.outputs)) or ("current_final",)
    evaluation = evaluate(scenarios, outputs, engine=engine)
    designs = Designs(scenarios, columns, evaluation)
    failed = np.isin(np.arange(len(scenarios)), list(evaluation.failures))
    return {q.name: np.where(failed, np.nan, q.compute(designs)) for q in wanted}, evaluation


def resolve_engine(template: ScenarioTemplate, ranges: Sequence[Range], fixed: dict[str, Value], engine: str) -> str:
    """Return the engine to use: ``auto`` is exact where the circuits are linear, else ngspice.

    Raises InputError where no design is possible, and for ``exact`` where the circuits are not linear.
    """
    space = Space(template, tuple(ranges), fixed, engine)
    scenarios = [space.scenario(space.values(np.full(len(ranges), share))) for share in np.linspace(0, 1, _TRIED)]
    scenario = next((c for c in scenarios if isinstance(c, Scenario)), None)
    if scenario is None:
        raise InputError(
            f"no design between the lower and the upper ends of the ranges can be: {scenarios[_TRIED // 2]}"
        )
    linear = strip_netlist(scenario.actuator, tip=scenario.tip, beam=scenario.beam, load=scenario.load).linear
    if engine == "exact" and not linear:
        raise InputError("the exact engine solves linear circuits only, and this one is not; use ngspice or auto")
    return engine if engine != "auto" else "exact" if linear else "ngspice"
