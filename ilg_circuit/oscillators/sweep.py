"""Period and amplitude over a parameter: CPG §6.4.1 (e), §6.4.2 (Tr) and §6.4.3 (a)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, Mask, plain
from ..errors import InputError, argument
from ..result import Column, Result
from ..units import parse
from .network import Network, wired
from .rhythm import rhythm

#: Parameter -> SI unit.
PARAMETERS = {"inhibition": "", "adaptation": "", "tonic": "", "rise-time": "s", "adaptation-time": "s"}
MOST_VALUES = 10_000


@dataclass(frozen=True, repr=False, eq=False)
class RhythmSweep(Result):
    """The rhythms of a network over the values of one parameter, as `ilg_circuit.cpg` returns them for a sweep.

    Attributes
    ----------
    parameter : str
        Name of the parameter.
    values : ndarray (n,)
        Its values [SI].
    outcomes : tuple of str
        Long-term behaviour at each value, as in `Rhythm`.
    period : ndarray (n,)
        Periods [s]; NaN without a cycle.
    amplitude : ndarray (n,)
        Amplitudes; NaN where the outcome is undecided.
    """

    presenter: ClassVar[str] = "cpg_sweep"

    parameter: str
    values: Array
    outcomes: tuple[str, ...]
    period: Array
    amplitude: Array

    @property
    def oscillates(self) -> Mask:
        """(n,); False where undecided."""
        return np.array([o in ("cycle", "irregular") for o in self.outcomes])

    def to_dict(self) -> dict[str, Any]:
        """Return parameter, unit and a row a value; None where there is no period, or where undecided."""
        columns = zip(self.values.tolist(), self.outcomes, plain(self.period), plain(self.amplitude), strict=True)
        keys = (self.parameter, "outcome", "period_s", "amplitude")
        rows = [dict(zip(keys, row, strict=True)) for row in columns]
        return {"parameter": self.parameter, "unit": PARAMETERS[self.parameter], "rows": rows}

    def table(self) -> tuple[Column, ...]:
        """Return parameter, oscillates (1 or 0), period_s, amplitude; None, NaN where there is none, or undecided."""
        pairs = zip(self.outcomes, self.oscillates, strict=True)
        flags = [None if outcome == "undecided" else int(moving) for outcome, moving in pairs]
        return (
            Column(self.parameter.replace("-", "_"), self.values, PARAMETERS[self.parameter], over=True),
            Column("oscillates", flags, ""),
            Column("period", self.period, "s"),
            Column("amplitude", self.amplitude, ""),
        )


def sweep(
    build: Callable[[float], Network],
    parameter: str,
    values: ArrayLike,
    start: ArrayLike | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> RhythmSweep:
    """Return the rhythm of ``build(value)`` for each of ``values``, always from the same ``start`` (default: paper's).

    ``progress(done, total)`` is called after each. Raises InputError for an unknown parameter, or too many values.
    """
    if parameter not in PARAMETERS:
        raise InputError(f"cannot sweep '{parameter}'; choose one of {', '.join(PARAMETERS)}")
    numbers = np.atleast_1d(np.asarray(values, dtype=float))
    if not 1 <= numbers.size <= MOST_VALUES or numbers.ndim != 1:
        raise InputError(f"a sweep takes 1 to {MOST_VALUES} values, not {numbers.size}")
    rhythms = []
    for k, value in enumerate(numbers.tolist()):
        rhythms.append(rhythm(build(value), start))
        if progress:
            progress(k + 1, len(numbers))
    period = np.array([np.nan if r.period is None else r.period for r in rhythms])
    amplitude = np.array([np.nan if r.oscillates is None else r.amplitude for r in rhythms])
    return RhythmSweep(parameter, numbers, tuple(r.outcome for r in rhythms), period, amplitude)


def cpg_sweep(
    text: str, *, start: ArrayLike | None = None, progress: Callable[[int, int], None] | None = None, **wiring: Any
) -> RhythmSweep:
    """Return `sweep` for a text such as ``inhibition=1:5:41``: 41 values from 1 to 5; ``wiring`` as in `wired`.

    Raises InputError for a text that is not understood.
    """
    name = text.partition("=")[0].strip()
    if name not in PARAMETERS:
        raise InputError(f"cannot sweep '{name}'; choose one of {', '.join(PARAMETERS)}, as in inhibition=1:5:41")
    numbers = swept_values(text, PARAMETERS[name])
    if name == "inhibition" and wiring.get("weights") is not None:
        raise InputError(
            f"inhibition belongs to a topology; with {argument('weights')} sweep adaptation, tonic or a time"
        )
    key = name.replace("-", "_")
    return sweep(lambda value: wired(**{**wiring, key: value}), name, numbers, start, progress)


def swept_values(text: str, unit: str, example: str = "inhibition=1:5:41") -> Array:
    """Return the values (n,) of a text such as ``inhibition=1:5:41``. Raises InputError if it is not understood."""
    name, _, rest = (part.strip() for part in text.partition("="))
    try:
        first, last, count = (part.strip() for part in rest.split(":"))
    except ValueError:
        raise InputError(
            f"{argument('sweep')} '{text}' is not understood; write it like {example}, from, to and how many"
        ) from None
    low, high = (parse(end, unit, f"{argument('sweep')} {name}") for end in (first, last))
    if not count.isdecimal() or not 1 <= int(count) <= MOST_VALUES:
        raise InputError(f"{argument('sweep')}: '{count}' is not a number of values; give 1 to {MOST_VALUES}")
    return np.linspace(low, high, int(count))
