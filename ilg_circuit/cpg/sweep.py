"""How period and amplitude go with a parameter: CPG §6.4.1 (e), §6.4.2 (Tr) and §6.4.3 (a)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, Mask
from ..errors import InputError
from ..files import write_text
from .network import Network
from .rhythm import rhythm

#: name of a parameter -> (column of a CSV file, SI unit)
PARAMETERS = {
    "inhibition": ("inhibition", ""),
    "adaptation": ("adaptation", ""),
    "tonic": ("tonic", ""),
    "rise-time": ("rise_time_s", "s"),
    "adaptation-time": ("adaptation_time_s", "s"),
}
MOST_VALUES = 10_000


@dataclass(frozen=True)
class Sweep:
    """Rhythms over ``values`` (n,) [SI] of ``parameter``.

    ``outcomes`` (n,) as in `Rhythm`; ``period`` (n,) [s], NaN without a cycle; ``amplitude`` (n,), NaN where undecided.
    """

    parameter: str
    values: Array
    outcomes: tuple[str, ...]
    period: Array
    amplitude: Array

    @property
    def oscillates(self) -> Mask:
        """(n,); False where it could not be decided."""
        return np.array([o in ("cycle", "irregular") for o in self.outcomes])

    def write_csv(self, path: str | Path) -> None:
        """Write parameter, oscillates (1 or 0), period_s and amplitude; blank where there is none, or undecided."""
        rows = [f"{PARAMETERS[self.parameter][0]},oscillates,period_s,amplitude"]
        table = zip(self.values.tolist(), self.outcomes, self.period.tolist(), self.amplitude.tolist(), strict=True)
        for value, outcome, period, amplitude in table:
            flag = "" if outcome == "undecided" else str(int(outcome in ("cycle", "irregular")))
            rows.append(",".join([repr(value), flag, *("" if np.isnan(v) else repr(v) for v in (period, amplitude))]))
        write_text(Path(path), "\n".join(rows) + "\n")


def sweep(
    build: Callable[[float], Network],
    parameter: str,
    values: ArrayLike,
    start: ArrayLike | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep:
    """The rhythm of ``build(value)`` for each of ``values``, always from the same ``start`` (by default the paper's).

    ``progress(done, total)`` is called after each.
    """
    if parameter not in PARAMETERS:
        raise InputError(f"cannot sweep '{parameter}'; choose one of {', '.join(PARAMETERS)}")
    numbers = np.atleast_1d(np.asarray(values, dtype=float))
    if not 1 <= numbers.size <= MOST_VALUES or numbers.ndim != 1:
        raise InputError(f"a sweep takes 1 to {MOST_VALUES} values, not {numbers.size}")
    found = []
    for k, value in enumerate(numbers.tolist()):
        found.append(rhythm(build(value), start))
        if progress:
            progress(k + 1, len(numbers))
    period = np.array([np.nan if r.period is None else r.period for r in found])
    amplitude = np.array([np.nan if r.oscillates is None else r.amplitude for r in found])
    return Sweep(parameter, numbers, tuple(r.outcome for r in found), period, amplitude)
