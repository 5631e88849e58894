"""Load tests: the mode of a test, its stretches and its nominal stresses, checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError, argument, wrong_choice
from ..units import format_quantity
from .branches import KINDS, LOADING, Leg, find_legs
from .kind import LOAD_TEST
from .load_causes import likely_cause
from .table import Table

#: The three standard tests: pulled along one axis, along two, or wide and short (pure shear).
LOAD_MODES = ("uniaxial", "equibiaxial", "planar")

#: Stress of an unloaded specimen, relative to the largest, above which it is an offset and not noise.
_OFFSET = 0.05
#: Least offset of noisy readings in standard deviations; least number of readings to find it.
_BEYOND, _TELLING = 4.0, 10
#: Stress extrapolated to stretch 1, relative to the largest, above which it is an offset.
_POINTED = 0.1
#: Range of the first readings that are extrapolated, as a fraction; their least number; range of the first of them.
_FIRST, _POINTING, _NEAR = 0.25, 6, 0.1
#: Condition number above which readings do not determine a parabola.
_SINGULAR = 1e4
#: Largest stretch; its inverse is the smallest. Other numbers are strains, percentages or lengths.
_LARGEST = 100.0
#: If no reading is below the first value, a stretch above the second may be a strain in percent.
_NEAREST, _FAR = 1.5, 5.0
#: Limits of the largest stress of a test [Pa]: below any foam, above any crystal.
_STRESSES = (1e-6, 1e13)
#: Distance from 1 below which a stretch counts as 1.
_UNSTRETCHED = 1e-9
#: Branches of a test that can be fitted.
BRANCHES = (*KINDS, "all")


@dataclass(frozen=True)
class LoadTest:
    """A measured load test: nominal stress over stretch, as `ilg_circuit.read` returns it.

    Rows stay in their order, which separates loading from unloading. Rows at stretch 1 are checked and left out: every
    material has zero stress there, so those rows depend on no constant.

    Attributes
    ----------
    mode : {"uniaxial", "equibiaxial", "planar"}
        Kind of test.
    stretch : ndarray (n,)
        Deformed over undeformed length.
    stress : ndarray (n,)
        Nominal stress [Pa].
    source : str
        Name of the file or of the data.
    legs : tuple of Leg
        Branches of loading, unloading and reloading.
    branch : str
        The branch that `taking` selected, empty for the whole test.
    ordered : bool
        False if the rows were in no order; they are then sorted by stretch.
    """

    mode: str
    stretch: Array
    stress: Array
    source: str = "data"
    legs: tuple[Leg, ...] = ()
    branch: str = ""
    ordered: bool = True

    def __post_init__(self) -> None:
        if self.branch:  # part of a test that was checked
            return
        if self.mode not in LOAD_MODES:
            raise wrong_choice("test", self.mode, LOAD_MODES)
        stretch, stress = (np.array(v, dtype=float).ravel() for v in (self.stretch, self.stress))
        if len(stretch) != len(stress):
            raise InputError(
                f"{self.source}: {len(stretch)} stretches and {len(stress)} stresses; give as many of each"
            )
        self._require_numbers(stretch, stress)
        legs = find_legs(stretch, stress)
        if legs is None:
            order = np.argsort(stretch, kind="stable")
            stretch, stress = stretch[order], stress[order]
            object.__setattr__(self, "ordered", False)
            legs = (Leg(LOADING, stretch, stress),)
        first = _of_kind(legs, LOADING) or legs
        self._require_signs(*_joined(first))
        legs = tuple(leg for leg in map(_loaded, legs) if len(leg.stretch))
        if not legs:
            raise InputError(f"{self.source}: no reading at a stretch other than 1 in the {self.mode} test")
        stretch, stress = _joined(legs)
        object.__setattr__(self, "legs", legs)
        object.__setattr__(self, "stretch", stretch)
        object.__setattr__(self, "stress", stress)

    def _require_numbers(self, stretch: Array, stress: Array) -> None:
        """Raise InputError for numbers that cannot be stretches or stresses."""
        for name, values in (("stretch", stretch), ("stress", stress)):
            if not np.isfinite(values).all():
                wrong = values[~np.isfinite(values)][0]
                raise InputError(f"{self.source}: a {name} is {wrong}; give finite numbers, leave gaps out")
        largest = float(np.abs(stress).max(initial=0.0))
        if largest == 0:
            raise InputError(f"{self.source}: every stress is zero; give the nominal stresses that were measured")
        beyond = (stretch < 1 / _LARGEST) | (stretch > _LARGEST)
        if beyond.any():
            raise InputError(
                f"{self.source}: stretch {stretch[beyond][0]:g}: a stretch is deformed over undeformed length, "
                f"from {1 / _LARGEST:g} to {_LARGEST:g}; {likely_cause(stretch, stress)}"
            )
        if not _STRESSES[0] <= largest <= _STRESSES[1]:
            raise InputError(
                f"{self.source}: the largest stress is {largest:.3g} Pa, which no material has; check its unit"
            )
        if stretch.min() >= _NEAREST and stretch.max() > _FAR:
            raise InputError(
                f"{self.source}: stretches from {stretch.min():g} to {stretch.max():g}, none near 1: "
                f"{likely_cause(stretch, stress)}; if they are stretches, give the unloaded row (1, 0) too"
            )

    def _require_signs(self, stretch: Array, stress: Array) -> None:
        """Raise InputError where a stress at stretch 1 is not zero, or has the wrong sign elsewhere."""
        largest = float(np.abs(stress).max(initial=0.0))
        rest = float(np.abs(stress[np.abs(stretch - 1) <= _UNSTRETCHED]).max(initial=0.0))
        offset = "where nothing pulls; subtract the offset, or count the stretch from the unloaded length"
        least = max(_OFFSET * largest, _BEYOND * _scatter(stretch, stress))
        if rest > least:
            raise InputError(f"{self.source}: stress {format_quantity(rest, 'Pa', 4)} at stretch 1, {offset}")
        opposed = ((stretch - 1) * stress < 0) & (np.abs(stress) > least)
        if opposed.any():
            k = int(np.argmax(opposed * np.abs(stretch - 1)))
            kind, side = ("tensile", "below") if stress[k] > 0 else ("compressive", "above")
            raise InputError(
                f"{self.source}: {kind} stress {format_quantity(float(stress[k]), 'Pa', 4)} at stretch "
                f"{stretch[k]:g}, {side} 1: stress and stretch have opposite signs; {likely_cause(stretch, stress)}"
            )
        pointed = _pointed(stretch, stress)
        if abs(pointed) > _POINTED * largest:
            raise InputError(
                f"{self.source}: the first readings point to a stress beyond {format_quantity(pointed, 'Pa', 2)} at "
                f"stretch 1, {offset}; or {likely_cause(stretch, stress)}"
            )

    @property
    def range(self) -> tuple[float, float]:
        """The smallest and the largest stretch, 1 included: the test starts unloaded."""
        return min(1.0, float(self.stretch.min())), max(1.0, float(self.stretch.max()))

    @property
    def extent(self) -> tuple[float, float]:
        """The smallest and the largest stretch that was read."""
        return float(self.stretch.min()), float(self.stretch.max())

    @property
    def path(self) -> Array:
        """The path length of the stretch, back and forth, up to each reading (n,), from 0."""
        return np.concatenate([[0.0], np.abs(np.diff(self.stretch)).cumsum()])

    def __repr__(self) -> str:
        """Return mode, number of readings and their ranges in a line."""
        low, high = self.extent
        return (
            f"LoadTest: {self.mode}, {len(self.stretch)} readings from {self.source}, stretch {low:.4g} to {high:.4g}, "
            f"stress up to {format_quantity(float(np.abs(self.stress).max()), 'Pa', 4)}"
        )

    def taking(self, branch: str) -> LoadTest:
        """Return the readings of one branch of the test.

        Parameters
        ----------
        branch : {"loading", "unloading", "reloading", "all"}
            The branch. Rows that run one way only are all taken as loading.

        Returns
        -------
        LoadTest
            The test with these readings alone.

        Raises
        ------
        InputError
            There is no such branch, or it has no readings.
        """
        if branch not in BRANCHES:
            raise wrong_choice("branch", branch, BRANCHES)
        legs = self.legs if branch == "all" else _of_kind(self.legs, branch)
        if len(self.legs) == 1 and branch == LOADING:
            legs = self.legs
        if not legs:
            counts = ", ".join(f"{count} of {kind}" for kind, count in self.counts.items())
            raise InputError(f"{self.source}: no row is {branch}: there are {counts}; choose with {argument('branch')}")
        stretch, stress = _joined(legs)
        return LoadTest(self.mode, stretch, stress, self.source, self.legs, branch, self.ordered)

    @property
    def left_out(self) -> tuple[Leg, ...]:
        """The branches that `taking` did not take."""
        if len(self.legs) == 1 or self.branch in ("", "all"):
            return ()
        return tuple(leg for leg in self.legs if leg.kind != self.branch)

    @property
    def counts(self) -> dict[str, int]:
        """The number of readings of each kind of branch."""
        counts = {kind: sum(len(leg.stretch) for leg in self.legs if leg.kind == kind) for kind in KINDS}
        return {kind: count for kind, count in counts.items() if count}


def _of_kind(legs: Sequence[Leg], kind: str) -> tuple[Leg, ...]:
    return tuple(leg for leg in legs if leg.kind == kind)


def _joined(legs: Sequence[Leg]) -> tuple[Array, Array]:
    return np.concatenate([leg.stretch for leg in legs]), np.concatenate([leg.stress for leg in legs])


def _loaded(leg: Leg) -> Leg:
    """Return the readings of a leg at stretches other than 1."""
    rows = np.abs(leg.stretch - 1) > _UNSTRETCHED
    return Leg(leg.kind, leg.stretch[rows], leg.stress[rows])


def _scatter(stretch: Array, stress: Array) -> float:
    """Return the standard deviation of the noise [Pa] from second differences along the stretch; 0 for few readings."""
    if len(stress) < _TELLING:
        return 0.0
    bends = np.diff(stress[np.argsort(stretch, kind="stable")], 2)
    return float(np.sqrt(np.mean(bends**2) / 6))


def _pointed(stretch: Array, stress: Array) -> float:
    """Return a lower limit of the stress [Pa] extrapolated to stretch 1 from the readings near it.

    A parabola is fitted to the first part of the range, to six readings or more, on the side of the farthest reading;
    three standard errors are subtracted. 0 if the first reading is beyond the first tenth of the range.
    """
    strain = stretch - 1
    side = np.sign(strain[np.argmax(np.abs(strain))])
    chosen = side * strain > _UNSTRETCHED
    order = np.argsort(np.abs(strain[chosen]), kind="stable")
    x, y = np.abs(strain[chosen][order]), stress[chosen][order]
    if len(x) < _POINTING or x[0] > _NEAR * x[-1]:
        return 0.0
    n = max(int((x <= _FIRST * x[-1]).sum()), _POINTING)
    columns = np.vander(x[:n] / x[n - 1], 3, increasing=True)
    if not np.linalg.cond(columns) < _SINGULAR:
        return 0.0
    inverse = np.linalg.pinv(columns)
    value = float(inverse[0] @ y[:n])
    rest = y[:n] - columns @ (inverse @ y[:n])
    error = float(np.linalg.norm(inverse[0]) * np.sqrt(rest @ rest / (n - 3)))
    return float(np.sign(value)) * max(abs(value) - 3 * error, 0.0)


def load_test_of(table: Table, mode: str) -> LoadTest:
    """Return the load test in a table, a true stress divided by the stretch; rows with a blank are left out.

    Raises
    ------
    InputError
        The stress is missing or given twice, no row is complete, or the readings are impossible; the message says what
        to do.
    """
    stretch = table.columns["stretch"]
    nominal, true = table.columns.get("stress"), table.columns.get("true stress")
    if (nominal is None) == (true is None):
        what = "no column for stress" if nominal is None else "a nominal and a true stress; leave one out"
        others = f"; not understood: {', '.join(repr(c) for c in table.ignored)}" if table.ignored else ""
        raise InputError(f"{table.source}: {what}{others}; columns are written like {LOAD_TEST.example}")
    stress = nominal if true is None else true / np.where(stretch == 0, 1.0, stretch)
    assert stress is not None  # one of the two exists
    known = np.isfinite(stretch) & np.isfinite(stress)
    if not known.any():
        raise InputError(f"{table.source}: no row has both a stretch and a stress")
    return LoadTest(mode, stretch[known], stress[known], table.source)
