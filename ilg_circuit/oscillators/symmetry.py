"""Symmetry: neurons with equal starts and equal inputs stay equal, and are reduced to a smaller network.

Rounding would separate them wherever the symmetric motion is unstable, and a network that in theory stays at rest
would seem to oscillate. Therefore one neuron of each class is computed, which is exact, and faster.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .network import Network


@dataclass(frozen=True)
class Quotient:
    """``network`` has one neuron for each class; ``classes`` (n,) is the class of every neuron of the full one."""

    network: Network
    classes: NDArray[np.intp]

    @property
    def trivial(self) -> bool:
        """True if every neuron is a class of its own."""
        return self.network.size == len(self.classes)

    def folded(self, state: Array) -> Array:
        """Return the state (2 c,) of the classes from a state (2 n,) of the full network, equal within classes."""
        n, c = len(self.classes), self.network.size
        result = np.empty(2 * c)
        result[self.classes] = state[:n]
        result[c + self.classes] = state[n:]
        return result

    def unfolded(self, states: Array) -> Array:
        """Return states (..., 2 n) of the full network from states (..., 2 c) of the classes."""
        c = self.network.size
        return np.concatenate([states[..., self.classes], states[..., c + self.classes]], axis=-1)


def quotient(network: Network, start: Array) -> Quotient:
    """Return the coarsest classes of neurons equal in start, tonic input, and input from every class.

    Found by refinement until nothing changes. Sums of weights are correctly rounded, so their order does not matter.
    """
    n, w = network.size, network.matrix
    classes = _numbered([(float(start[k]), float(start[n + k]), float(network.tonics[k])) for k in range(n)])
    while True:
        received = _received(w, classes)
        refined = _numbered([(int(classes[k]), *received[k]) for k in range(n)])
        if refined.max() == classes.max():
            break
        classes = refined
    if len(set(classes.tolist())) == n:
        return Quotient(network, np.arange(n))
    _, members = np.unique(classes, return_index=True)
    units = tuple((int(classes[a]), int(classes[b])) for a, b in network.units)
    tonic = tuple(network.tonics[members].tolist())
    return Quotient(replace(network, weights=[received[m] for m in members], tonic=tonic, units=units), classes)


def _received(w: Array, classes: NDArray[np.intp]) -> list[tuple[float, ...]]:
    """Return for each neuron the sum of the weights from each class."""
    groups = [np.flatnonzero(classes == c) for c in range(int(classes.max()) + 1)]
    return [tuple(math.fsum(row[g].tolist()) for g in groups) for row in w]


def _numbered(signatures: list[tuple[float, ...]]) -> NDArray[np.intp]:
    """Return the class numbers in order of first appearance."""
    numbers: dict[tuple[float, ...], int] = {}
    return np.array([numbers.setdefault(s, len(numbers)) for s in signatures], dtype=np.intp)
