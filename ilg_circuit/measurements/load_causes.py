"""Finds likely causes of impossible stretches and stresses: columns exchanged, strains, percent, signs."""

from __future__ import annotations

import numpy as np

from ..arrays import Array

#: Units of stress that an exchanged column may be written in [Pa].
_UNITS = (1.0, 1e3, 1e6, 1e9)
#: Exchanged stretches begin within this distance of 1, at most at this fraction of the largest stress, and end below
#: this value.
_NEAR, _SMALL, _LARGEST = 0.35, 0.35, 20.0
#: Largest excursion of a stretch to the wrong side of 1 that counts as rounding.
_ROUNDING = 0.02
#: Strains above this value are taken to be in percent.
_PERCENT = 5.0

_EXCHANGED = "the columns look exchanged: give the stretch as stretch and the stress as stress"
_STRAIN = "these look like strains: a strain of x is a stretch of 1 + x"
_STRAIN_PERCENT = "these look like strains in percent: a strain of x % is a stretch of 1 + x/100"
_STRETCH_PERCENT = "these look like stretches in percent: name the column stretch_%"
_SIGN = "tension is positive and stretches, compression is negative and shortens: turn the sign of the stress"
_UNKNOWN = (
    "look whether the columns are exchanged, or strains or percent are given: a strain of x is a stretch of 1 + x"
)


def likely_cause(stretch: Array, stress: Array) -> str:
    """Return a clause with the likely error in ``stretch`` and ``stress`` [Pa], both (n,), and its remedy."""
    if _exchanged(stretch, stress):
        return _EXCHANGED
    if _of_one_sign(stretch, stress) and np.abs(stretch).max() > _PERCENT:
        # a stretch in percent is unloaded at 100
        middle = float(stretch[np.argmin(np.abs(stress))])
        return _STRETCH_PERCENT if stretch.min() >= _PERCENT and middle > 50 else _STRAIN_PERCENT
    opposed = (stretch - 1) * stress < 0
    # the stress falls towards 0 for a strain, towards stretch 1 for a wrong sign
    if (stretch > 0).all() and opposed.sum() > 1 and _rises(np.abs(stretch - 1)[opposed], np.abs(stress)[opposed]):
        return _SIGN
    if _of_one_sign(stretch, stress):
        return _STRAIN
    return _UNKNOWN


def _exchanged(stretch: Array, stress: Array) -> bool:
    """Return True if the stresses, in some unit, begin at 1 at the smallest stretches and grow with them."""
    farthest = float(np.abs(stretch).max())
    for unit in _UNITS:
        other = stress / unit
        first = int(np.argmin(np.abs(other - 1)))
        near = abs(other[first] - 1) <= _NEAR and abs(stretch[first]) <= _SMALL * farthest
        sided = ((other - 1) * np.sign(stretch) >= -_ROUNDING).all()
        if near and sided and other.min() > 0 and other.max() <= _LARGEST and np.ptp(other) > 0:
            return _rises(stretch, other)
    return False


def _of_one_sign(strain: Array, stress: Array) -> bool:
    """Return True if the stress has the sign of the strain, apart from an offset, and grows with it."""
    largest = float(np.abs(stress).max())
    opposed = (strain * stress < 0) & (np.abs(stress) > 0.05 * largest)
    return not opposed.any() and _rises(np.abs(strain), np.abs(stress))


def _rises(x: Array, y: Array) -> bool:
    """Return True if y grows with x overall, or if that cannot be decided."""
    return float((x - x.mean()) @ (y - y.mean())) >= 0
