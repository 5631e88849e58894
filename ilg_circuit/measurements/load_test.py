"""Load tests: the mode of a test, its stretches and its nominal stresses, checked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..units import format_quantity
from .kind import LOAD_TEST
from .table import Table

#: The three standard tests: pulled along one axis, along two, or wide and short (pure shear).
LOAD_MODES = ("uniaxial", "equibiaxial", "planar")

#: An unloaded specimen whose stress is more than this part of the largest has an offset, not noise.
_OFFSET = 0.05
#: Nothing stretches more, or shortens more than to the inverse: such a number is a strain, a percentage or a length.
_LARGEST = 100.0
#: The largest stress of a test [Pa] lies between these: softer than any foam, stronger than any crystal.
_STRESSES = (1e-6, 1e13)
#: A stretch closer to 1 is 1.
_UNSTRETCHED = 1e-9


@dataclass(frozen=True)
class LoadTest:
    """One load test: ``mode`` (of `LOAD_MODES`), ``stretch`` (n,) and nominal ``stress`` (n,) [Pa].

    Both ascend by stretch. Rows at stretch 1 are checked and left out: every material has zero stress there, so
    those rows depend on no constant.
    """

    mode: str
    stretch: Array
    stress: Array
    source: str = "data"

    def __post_init__(self) -> None:
        if self.mode not in LOAD_MODES:
            raise InputError(f"test is '{self.mode}'; choose one of {', '.join(LOAD_MODES)}")
        stretch, stress = (np.array(v, dtype=float).ravel() for v in (self.stretch, self.stress))
        if len(stretch) != len(stress):
            raise InputError(
                f"{self.source}: {len(stretch)} stretches and {len(stress)} stresses; give as many of each"
            )
        order = np.argsort(stretch, kind="stable")
        stretch, stress = stretch[order], stress[order]
        self._check(stretch, stress)
        loaded = np.abs(stretch - 1) > _UNSTRETCHED
        if not loaded.any():
            raise InputError(f"{self.source}: no reading at a stretch other than 1; the {self.mode} test says nothing")
        object.__setattr__(self, "stretch", stretch[loaded])
        object.__setattr__(self, "stress", stress[loaded])

    def _check(self, stretch: Array, stress: Array) -> None:
        for name, values in (("stretch", stretch), ("stress", stress)):
            if not np.isfinite(values).all():
                wrong = values[~np.isfinite(values)][0]
                raise InputError(f"{self.source}: a {name} is {wrong}; give finite numbers, leave gaps out")
        beyond = (stretch < 1 / _LARGEST) | (stretch > _LARGEST)
        if beyond.any():
            raise InputError(
                f"{self.source}: stretch {stretch[beyond][0]:g}: a stretch is deformed over undeformed length, "
                f"from {1 / _LARGEST:g} to {_LARGEST:g}; a strain of x is a stretch of 1 + x"
            )
        largest = float(np.abs(stress).max(initial=0.0))
        if largest == 0:
            raise InputError(f"{self.source}: every stress is zero; give the nominal stresses that were measured")
        if not _STRESSES[0] <= largest <= _STRESSES[1]:
            raise InputError(
                f"{self.source}: the largest stress is {largest:.3g} Pa, which no material has; check its unit"
            )
        rest = float(np.abs(stress[np.abs(stretch - 1) <= _UNSTRETCHED]).max(initial=0.0))
        if rest > _OFFSET * largest:
            raise InputError(
                f"{self.source}: stress {format_quantity(rest, 'Pa', 4)} at stretch 1, where nothing pulls; subtract "
                "the offset, or count the stretch from the unloaded length"
            )
        if float(((stretch - 1) * stress).sum()) <= 0:
            raise InputError(
                f"{self.source}: stress and stretch have opposite signs; tension is positive and stretches, "
                "compression is negative and shortens"
            )

    @property
    def range(self) -> tuple[float, float]:
        """The smallest and the largest stretch, 1 included: the test starts unloaded."""
        return min(1.0, float(self.stretch[0])), max(1.0, float(self.stretch[-1]))


def load_test_of(table: Table, mode: str) -> LoadTest:
    """Return the load test in a table, a true stress divided by the stretch; rows with a blank are left out.

    Raises
    ------
    InputError
        The stress is missing or there twice, no row is whole, or the readings are none; the message says what to do.
    """
    stretch = table.columns["stretch"]
    nominal, true = table.columns.get("stress"), table.columns.get("true stress")
    if (nominal is None) == (true is None):
        what = "no column for stress" if nominal is None else "a nominal and a true stress; leave one out"
        others = f"; not understood: {', '.join(repr(c) for c in table.ignored)}" if table.ignored else ""
        raise InputError(f"{table.source}: {what}{others}; columns are written like {LOAD_TEST.example}")
    stress = nominal if true is None else true / np.where(stretch == 0, 1.0, stretch)
    assert stress is not None  # one of the two is there
    known = np.isfinite(stretch) & np.isfinite(stress)
    if not known.any():
        raise InputError(f"{table.source}: no row has both a stretch and a stress")
    return LoadTest(mode, stretch[known], stress[known], table.source)
