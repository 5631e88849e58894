"""States of rest and their stability, from the eigenvalues of the pieces.

With the neurons S active a network rests where

    y_S = ((1 + d) I + W_SS)^-1 e_S > 0      and      e - W y <= 0 for all others,

and then x = e - d y - W y, v = y. Each eigenvalue mu of W_SS gives two of the piece:

    Tr Ta s^2 + (Tr + Ta (1 + mu)) s + 1 + mu + d = 0

and a silent neuron -1/Tr and -1/Ta. All sets S are tried, component by strongly connected component, so a chain of any
length is decided as surely as one of its units. Where a component is too large for that, states are searched for
instead, and the result says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from graphlib import TopologicalSorter

import numpy as np

from ..arrays import Array, ComplexArray, Mask
from .network import Network

#: Neurons of a strongly connected component whose active sets are all tried.
LARGEST_COMPONENT = 12
#: Active sets tried altogether, and states of rest kept.
_MOST_SETS = 40_000
_MOST_STATES = 1000
_SEARCHES = 200
#: Relative to the input: nearer to the threshold a neuron rests on it; relative to 1/Tr + 1/Ta: no growth at all.
_EDGE = 1e-12
_MARGINAL = 1e-12
#: The computed A'P + P A, which is to be -1, must be negative by this at least.
_PROVEN = 0.5
#: From this condition number on a set of equations is taken to have no single solution.
_SINGULAR = 1e13


@dataclass(frozen=True)
class RestState:
    """A state of rest: ``x`` (n,), with v = y = max(0, x); ``growth`` [1/s] the largest real part of an eigenvalue.

    ``edge`` is True if a neuron rests just on its threshold, between two pieces; ``growth`` is then the larger one.
    """

    x: Array
    growth: float
    marginal: bool
    edge: bool

    @property
    def active(self) -> tuple[int, ...]:
        """The active neurons, counted from 1."""
        return tuple(int(k) + 1 for k in np.flatnonzero(self.x > 0))

    @property
    def stable(self) -> bool:
        """True if every small disturbance decays; False for a state on an edge or without growth or decay."""
        return self.growth < 0 and not self.marginal and not self.edge

    @property
    def state(self) -> Array:
        """(x, v), (2 n,)."""
        return np.concatenate([self.x, np.maximum(self.x, 0)])


class Ellipsoid:
    """The motions away' P away < r around the rest of a stable piece, A'P + P A = -I: its flow never leaves them.

    ``a`` (m, m) [1/s] is the piece's A; ``gates`` (k, m) times the motion away from the rest may be as large as
    ``room`` (k,) before a neuron switches. Eigenvalues of a matrix whose modes are no basis are inexact: ``proven`` is
    True where P > 0 and A'P + P A < 0 are so as computed, and without that nothing is held.
    """

    def __init__(self, a: Array, gates: Array, room: Array) -> None:
        from scipy.linalg import matrix_balance, solve_continuous_lyapunov

        # in states of like size: inhibition of 1e8 would leave P without digits
        scaled, (self._sizes, _) = matrix_balance(a / np.abs(a).max(), permute=False, separate=True)
        form = solve_continuous_lyapunov(scaled.T, -np.eye(len(a)))
        self._form = (form + form.T) / 2
        rate = scaled.T @ self._form + self._form @ scaled
        self.proven = bool(np.linalg.eigvalsh(self._form)[0] > 0 and np.linalg.eigvalsh(rate)[-1] < -_PROVEN)
        self._radius = self._largest(gates * self._sizes, room) if self.proven else 0.0

    def _largest(self, gates: Array, room: Array) -> float:
        """Return the largest r within which no gate (k, m) reaches its room (k,), in the scaled states."""
        widths = (gates @ np.linalg.inv(self._form) * gates).sum(axis=1)  # the largest (gate away)^2 where r is 1
        seen = widths > 0
        return float((room[seen] ** 2 / widths[seen]).min(initial=np.inf))

    def holds(self, away: Array) -> bool:
        """Return whether a motion that is ``away`` (m,) from the rest stays in the piece for ever."""
        away = away / self._sizes
        return self.proven and bool(away @ self._form @ away < self._radius)


@dataclass(frozen=True)
class RestStates:
    """States of rest of a network; ``complete`` tells whether these are all, ``how`` in words how they were found."""

    states: tuple[RestState, ...]
    complete: bool
    how: str

    @property
    def stable(self) -> tuple[RestState, ...]:
        """The stable states."""
        return tuple(s for s in self.states if s.stable)


def growth(network: Network, active: Mask) -> float:
    """Return the largest real part [1/s] of the eigenvalues of the piece in which just ``active`` (n,) neurons fire."""
    rise, fatigue = network.rise_time, network.adaptation_time
    largest = -np.inf if active.all() else max(-1 / rise, -1 / fatigue)
    if active.any():
        mu = block_eigenvalues(network.matrix[np.ix_(active, active)])
        # in units of 1/Tr and 1/Ta: s^2 + b s + c = 0, roots without cancellation
        b = 1 / fatigue + (1 + mu) / rise
        c = (1 + mu + network.adaptation) / (rise * fatigue)
        root = np.sqrt(b**2 - 4 * c)
        root = np.where((b.conjugate() * root).real < 0, -root, root)
        far = -(b + root) / 2
        near = np.divide(c, far, out=np.zeros_like(c), where=far != 0)
        largest = max(largest, float(far.real.max()), float(near.real.max()))
    return largest


def rest_of_piece(network: Network, active: Mask) -> RestState | None:
    """Return the state of rest with just ``active`` (n,) neurons above threshold; None without one, or with many."""
    found, _ = _solve(network.matrix, network.tonics, network.adaptation, active)
    return None if found is None else _judged(network, found)


def rest_states(network: Network) -> RestStates:
    """Return all states of rest, or those found where there are too many active sets to try; see the module."""
    components = strong_components(network.matrix)
    if max(len(c) for c in components) <= LARGEST_COMPONENT:
        found, tried, continuum = _enumerated(network, components)
        if found is not None:
            states = tuple(_judged(network, x) for x in found)
            many = "; without those of sets that may have a line of them" if continuum else ""
            return RestStates(states, not continuum, f"all active sets ({tried}) tried{many}")
    found = _searched(network)
    how = f"search from {_SEARCHES} starts: {network.size} neurons have too many active sets to try"
    return RestStates(tuple(_judged(network, x) for x in found), False, how)


def _judged(network: Network, x: Array) -> RestState:
    tolerance = _EDGE * float(np.abs(network.tonics).max())
    on_edge = np.abs(x) <= tolerance
    active = x > tolerance
    rate = growth(network, active)
    if on_edge.any():
        rate = max(rate, growth(network, active | on_edge))
    marginal = abs(rate) <= _MARGINAL * (1 / network.rise_time + 1 / network.adaptation_time)
    return RestState(np.where(on_edge, 0.0, x), rate, marginal, bool(on_edge.any()))


def _solve(w: Array, inputs: Array, adaptation: float, active: Mask) -> tuple[Array | None, bool]:
    """Return x (n,) at rest on one active set under ``inputs`` e, and whether there may be many.

    x is None where it is not consistent or not determined.
    """
    y = np.zeros(len(w))
    largest = float(np.abs(inputs).max())
    if active.any():
        matrix = (1 + adaptation) * np.eye(int(active.sum())) + w[np.ix_(active, active)]
        if np.linalg.cond(matrix) > _SINGULAR:
            nearest = np.linalg.lstsq(matrix, inputs[active], rcond=1e-12)[0]
            return None, bool(np.abs(matrix @ nearest - inputs[active]).max() <= 1e-9 * largest)
        y[active] = np.linalg.solve(matrix, inputs[active])
    x = inputs - w @ y
    if (y[active] > _EDGE * largest).all() and (x[~active] <= _EDGE * largest).all():
        return np.where(active, y, x), False
    return None, False


def block_eigenvalues(matrix: Array) -> ComplexArray:
    """Return the eigenvalues (n,) of a matrix, block by block where it is block triangular.

    The units of a chain all have the same eigenvalues; computed from the whole matrix they would lose all digits.
    """
    blocks = [np.linalg.eigvals(matrix[np.ix_(c, c)]) for c in strong_components(matrix)]
    return np.concatenate(blocks).astype(np.complex128)


def strong_components(w: Array) -> list[list[int]]:
    """Return strongly connected components of the graph j -> i where w_ij is not 0, each after those that act on it."""
    from scipy.sparse.csgraph import connected_components

    count, labels = connected_components(w != 0, directed=True, connection="strong")
    graph: dict[int, set[int]] = {k: set() for k in range(count)}
    for i, j in np.argwhere(w != 0):
        if labels[i] != labels[j]:
            graph[int(labels[i])].add(int(labels[j]))
    return [np.flatnonzero(labels == k).tolist() for k in TopologicalSorter(graph).static_order()]


def _enumerated(network: Network, components: list[list[int]]) -> tuple[list[Array] | None, int, bool]:
    """Return x of all states of rest (None: too many), the number of sets tried, True if a line of states may exist."""
    partial = [np.zeros(network.size)]
    tried, continuum = 0, False
    for component in components:
        inner = network.matrix[np.ix_(component, component)]
        outer = network.matrix[component]
        sets = (np.arange(2 ** len(component))[:, None] >> np.arange(len(component)) & 1).astype(bool)
        extended: list[Array] = []
        for x in partial:
            y = np.maximum(x, 0)  # zero for components still to come
            inputs = network.tonics[component] - outer @ y
            tried += len(sets)
            if tried > _MOST_SETS:
                return None, tried, continuum
            for active in sets:
                found, many = _solve(inner, inputs, network.adaptation, active)
                continuum |= many
                if found is not None:
                    extended.append(x.copy())
                    extended[-1][component] = found
        partial = extended
        if len(partial) > _MOST_STATES:
            return None, tried, continuum
    return partial, tried, continuum


def _searched(network: Network) -> list[Array]:
    """Search states of rest by Newton's method on the active set, from many starts, equal in every call."""
    random = np.random.default_rng(20190901)
    found: dict[bytes, Array] = {}
    for _ in range(_SEARCHES):
        active = random.random(network.size) < random.random()
        for _ in range(50):
            # inactive neurons: x = e - W y; active: x = y
            one = np.eye(network.size)
            matrix = np.where(active, (1 + network.adaptation) * one + network.matrix, one)
            try:
                x = np.linalg.solve(matrix, network.tonics)
            except np.linalg.LinAlgError:
                break
            following = x > 0
            if (following == active).all():
                solved, _ = _solve(network.matrix, network.tonics, network.adaptation, active)
                if solved is not None:
                    found.setdefault(active.tobytes(), solved)
                break
            active = following
    return list(found.values())
