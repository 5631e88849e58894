"""Propagates the states of linear systems, x' = M x, over intervals of many widths by matrix exponentials."""

from __future__ import annotations

from collections import Counter

import numpy as np

from ..arrays import Array

#: Largest number of values in stored exponentials.
_MOST_KEPT = 20_000_000
#: Number of rare widths from which on they are made of halves, and number of intervals up to which a width is rare.
_MANY, _RARE = 100, 40
#: Terms of the Taylor series, and largest norm of its matrix: the term that follows is below rounding.
_TERMS, _SHORT = 12, 0.125


class Propagators:
    """The exponentials exp(M f w) of matrices M (n, s, s), for ``widths`` w (m,) [s] in a row and ``fractions`` f.

    Widths that differ by rounding only share one. For twice a width the exponential is squared. Where most widths are
    rare, as on an irregular grid, they are made of `Halves`.
    """

    def __init__(self, matrix: Array, widths: Array, fractions: Array) -> None:
        self._matrix, self._widths, self._fractions = matrix, widths, fractions
        self._keys = [_key(w) for w in widths.tolist()]
        self._last = {key: k for k, key in enumerate(self._keys)}
        self._kept: dict[str, Array] = {}
        self._rare = {key for key, count in Counter(self._keys).items() if count <= _RARE}
        self._halves = None
        if len(self._rare) > _MANY:
            halves = Halves(matrix, float(widths.max()))
            self._halves = halves if halves.size <= _MOST_KEPT else None

    def after(self, interval: int, x: Array) -> Array:
        """Return the states (n, fractions, s) at the fractions of an interval that begins with ``x`` (n, s, 1)."""
        if self._halves is not None and self._keys[interval] in self._rare:
            ends = self._fractions * self._widths[interval]
            return np.stack([self._halves.after(end, x)[..., 0] for end in ends.tolist()], axis=1)
        return np.asarray((self._of(interval) @ x[:, None])[..., 0])

    def _of(self, interval: int) -> Array:
        """Return the exponentials (n, fractions, s, s); widths that are not needed again are discarded."""
        key, width = self._keys[interval], float(self._widths[interval])
        if key not in self._kept:
            if (len(self._kept) + 1) * len(self._fractions) * self._matrix.size > _MOST_KEPT:
                self._kept.clear()
            half = self._kept.get(_key(width / 2))
            self._kept[key] = half @ half if half is not None else self._exponential(width)
        before = self._keys[interval - 1] if interval else key
        if before != key and self._last[before] < interval:
            self._kept.pop(before, None)
        return self._kept[key]

    def _exponential(self, width: float) -> Array:
        return exponentials(self._matrix[:, None], (width * self._fractions)[:, None, None])


class Halves:
    """The exponentials of ``longest`` [s], its half, its quarter and so on, up to where a Taylor series goes on.

    Any width up to the longest is a sum of them: as many products of a matrix and a vector as it has binary digits.
    Each exponential is computed by itself, since squaring the next shorter one would lose the digits of slow states.
    """

    def __init__(self, matrix: Array, longest: float) -> None:
        size = float(np.abs(matrix).sum(axis=1).max()) * longest
        count = max(int(np.ceil(np.log2(size / _SHORT))), 0) + 1 if 0 < size < np.inf else 1
        self._matrix = matrix
        self._widths = (longest * 0.5 ** np.arange(count)).tolist()
        self._kept: dict[float, Array] = {}
        self.size = count * matrix.size

    def after(self, width: float, x: Array) -> Array:
        """Return the states (n, s, 1) after ``width`` [s], of those at its begin."""
        left = width
        for part in self._widths:
            if left >= part:
                if part not in self._kept:
                    self._kept[part] = exponentials(self._matrix, part)
                x = self._kept[part] @ x
                left -= part
        term = x
        for k in range(1, _TERMS + 1):
            term = self._matrix @ term * (left / k)
            x = x + term
        return x


def exponentials(matrix: Array, widths: float | Array) -> Array:
    """Return exp(matrix widths), of numbers that broadcast to (..., s, s)."""
    from scipy.linalg import expm

    return np.asarray(expm(matrix * widths))


def _key(width: float) -> str:
    """Return a width to 12 digits."""
    return f"{width:.11e}"
