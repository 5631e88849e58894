"""The designs that a search may choose from: ranges of parameters as a unit cube, and what each design in it does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..circuit.strip import strip_netlist
from ..errors import IlgError, InputError
from .evaluate import STUDY_ACCURACY, Evaluation, evaluate
from .parameters import Base, Case, Value, apply
from .plan import Span, parse_span
from .quantities import Designs, Quantity

Array = NDArray[np.float64]
#: Told how many designs have been simulated since it was last told.
Counter = Callable[[int], None]

#: Digits to which a chosen design's sizes are rounded: what is printed is what was simulated.
_DIGITS = 6
#: Designs from the lower to the upper ends of all ranges, one of which must be possible.
_TRIED = 33


def parse_ranges(texts: Sequence[str]) -> tuple[tuple[Span, ...], dict[str, Value]]:
    """What ``thickness=0.2mm:1mm`` and ``width=5mm`` leave open, by equal ratios where they can, and what they fix."""
    spans: list[Span] = []
    fixed: dict[str, Value] = {}
    for text in texts:
        span, count = parse_span(text)
        name = span.parameter.name
        if name in fixed or name in (s.parameter.name for s in spans):
            raise InputError(f"{name} is varied twice; give it once")
        if count is not None or len(span.values) > 1:
            raise InputError(f"'{text[:60]}': a design is looked for in a whole range; write it like {name}=from:to")
        if span.values:
            fixed[name] = span.values[0]
        else:
            spans.append(replace(span, log=span.low > 0))
    if not spans:
        raise InputError("nothing is left to choose; give a range, such as --vary thickness=0.2mm:1mm")
    return tuple(spans), fixed


@dataclass(frozen=True, eq=False)
class Space:
    """A unit cube of designs of ``base``: a place (n,) in it is a share of each of the n ``spans``.

    ``fixed`` are values that all of them share. ``engine``: exact or ngspice. ``count`` is told of every simulation.
    """

    base: Base
    spans: tuple[Span, ...]
    fixed: dict[str, Value]
    engine: str
    count: Counter = lambda _: None

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(span.parameter.name for span in self.spans)

    def columns(self, places: Array) -> dict[str, Array]:
        """Values (k,) [SI] of each parameter at ``places`` (k, n)."""
        return {
            s.parameter.name: np.clip(np.asarray(s.at(places[:, j]), dtype=float), s.low, s.high)
            for j, s in enumerate(self.spans)
        }

    def place(self, values: dict[str, float]) -> Array:
        """The place (n,) of a design, as near as the ranges let it be."""
        shares = []
        for s in self.spans:
            x = min(max(values[s.parameter.name], s.low), s.high)
            shares.append(np.log(x / s.low) / np.log(s.high / s.low) if s.log else (x - s.low) / (s.high - s.low))
        return np.asarray(np.clip(shares, 0.0, 1.0))

    def rounded(self, place: Array) -> dict[str, float]:
        """The design at ``place`` (n,) with sizes of a few digits, within the ranges."""
        values = {name: float(column[0]) for name, column in self.columns(place[None]).items()}
        return {
            s.parameter.name: min(max(float(f"{values[s.parameter.name]:.{_DIGITS}g}"), s.low), s.high)
            for s in self.spans
        }

    def case(self, values: dict[str, float]) -> Case | str:
        """The case of a design, or the reason why it cannot be."""
        try:
            return apply(self.base, {**self.fixed, **values})
        except (IlgError, ArithmeticError) as error:
            return " ".join(str(error).split()) or type(error).__name__

    def cases(self, columns: dict[str, Array]) -> list[Case | str]:
        """The cases of ``columns``, parameter -> values (k,)."""
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return [self.case(dict(zip(columns, row, strict=True))) for row in rows]

    def look(self, places: Array, quantities: Sequence[Quantity]) -> Array:
        """Values (k, q) of ``quantities`` at ``places`` (k, n); NaN where a design cannot be or fails."""
        columns = self.columns(np.atleast_2d(places))
        cases = self.cases(columns)
        self.count(len(cases))
        return measure(cases, columns, quantities, self.engine)[0]


def measure(
    cases: Sequence[Case | str], columns: dict[str, Array], quantities: Sequence[Quantity], engine: str
) -> tuple[Array, Evaluation]:
    """Values (k, q) of ``quantities`` of ``cases``, and the evaluation that they come from."""
    outputs = tuple(dict.fromkeys(name for q in quantities for name in q.outputs)) or ("current_final",)
    accuracy = STUDY_ACCURACY
    evaluation = evaluate(cases, outputs, engine=engine, accuracy=accuracy)
    designs = Designs(cases, columns, evaluation)
    values = np.column_stack([q.compute(designs) for q in quantities])
    values[list(evaluation.failures)] = np.nan
    return values, evaluation


def resolve_engine(base: Base, spans: Sequence[Span], fixed: dict[str, Value], engine: str) -> str:
    """``auto`` as exact where the circuits are linear, else as ngspice. Raises InputError where exact cannot be."""
    space = Space(base, tuple(spans), fixed, engine)
    cases = space.cases(space.columns(np.linspace(0, 1, _TRIED)[:, None] * np.ones(len(spans))))
    case = next((c for c in cases if isinstance(c, Case)), None)
    if case is None:
        raise InputError(f"no design between the lower and the upper ends of the ranges can be: {cases[_TRIED // 2]}")
    linear = strip_netlist(case.actuator, tip=case.tip, beam=case.beam, load=case.load).linear
    if engine == "exact" and not linear:
        raise InputError("the exact engine solves linear circuits only, and this one is not; use ngspice or auto")
    return engine if engine != "auto" else "exact" if linear else "ngspice"
