"""The flow of a network, exact to rounding: between two switches of max(0, x) a network is linear.

On a set of active neurons (x > 0) the state z = (x, v, 1) obeys z' = A z. Over a step h = 1/rho, rho the spectral
radius of |A| (the least norm of A over all scalings of the state), its Taylor series ends, to double precision, after
eighteen terms. So each x_i is a polynomial on the step, whose Bernstein coefficients tell by their changes of sign
(Descartes' rule) whether, and by subdivision where, it first meets zero: no switch is missed, and no tolerance enters.

The vector field is continuous across a switch; only its slope jumps. So the derivative of the flow by its start is the
product of the pieces' exponentials, with nothing added at switches.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, Mask
from ..errors import InputError, SolveError
from .network import Network

Active = Mask

#: Terms after the first of the Taylor series; 1/19! is below rounding.
ORDER = 18
#: A longer run is refused: about a minute of computing.
MOST_STEPS = 2_000_000
#: Memory for the series of the pieces met so far [bytes].
_CACHE = 200_000_000
#: Networks of more states than this (2 n + 1) do without stacks of matrix powers.
_LARGEST_STACK = 41
#: Multiplications for the spectral radius.
_POWERS = 40
#: A pair of roots closer than this, in steps, is a touch of zero, to rounding.
_TOUCH = 1e-12
#: A state this many times larger than input and start has no rest or cycle to go to.
_UNBOUNDED = 1e9

_EXPONENTS = np.arange(ORDER + 1)
_FACTORIALS = np.array([float(math.factorial(k)) for k in range(ORDER + 1)])
#: A polynomial of a matrix is one in this power of it, whose coefficients are polynomials of a lower order.
_POWER = 4
#: Monomial coefficients times this are Bernstein coefficients: C(j, k)/C(ORDER, k), (ORDER + 1, ORDER + 1).
_BERNSTEIN = np.array([[math.comb(j, k) / math.comb(ORDER, k) for j in range(ORDER + 1)] for k in range(ORDER + 1)])


@dataclass(frozen=True)
class _Series:
    """The Taylor series of a piece: ``step`` h [s], ``matrix`` A h (2 n + 1, 2 n + 1); for small networks also all
    (A h)^k/k!, k = 0 to ORDER, as ``rows`` ((ORDER + 1) (2 n + 1), 2 n + 1), which is faster but takes much memory.
    """

    step: float
    matrix: Array
    rows: Array | None

    def terms(self, z: Array, order: int = ORDER) -> Array:
        """Return the Taylor terms (order + 1, 2 n + 1) of the motion from ``z`` (2 n + 1,)."""
        if self.rows is not None:
            return np.asarray((self.rows[: (order + 1) * len(z)] @ z).reshape(order + 1, -1))
        result = np.empty((order + 1, len(z)))
        result[0] = z
        for k in range(1, order + 1):
            np.dot(self.matrix, result[k - 1], out=result[k])
            result[k] /= k
        return result

    @cached_property
    def whole(self) -> Array:
        """exp(A h) (2 n + 1, 2 n + 1)."""
        return self.exponential(1.0)

    def exponential(self, length: float) -> Array:
        """Return exp(A h ``length``) (2 n + 1, 2 n + 1), for lengths up to 1."""
        m = len(self.matrix)
        if self.rows is not None:
            return np.asarray((length**_EXPONENTS @ self.rows.reshape(ORDER + 1, -1)).reshape(m, m))
        factors = length**_EXPONENTS / _FACTORIALS
        total = np.zeros((m, m))
        for k in range(ORDER - ORDER % _POWER, -1, -_POWER):  # Horner's scheme in (A h)^4
            few = factors[k : k + _POWER]
            total = self._powers[-1] @ total + np.tensordot(few, self._powers[: len(few)], 1)
        return total

    @cached_property
    def _powers(self) -> Array:
        """(A h)^k (5, 2 n + 1, 2 n + 1), k = 0 to 4."""
        a = self.matrix
        square = a @ a
        return np.stack([np.eye(len(a)), a, square, square @ a, square @ square])


@dataclass(frozen=True)
class Stretch:
    """A step within one piece: the state is sum_k ``terms``[k] s^k, s from 0 to ``length`` in units of ``step`` [s].

    ``terms`` (ORDER + 1, 2 n); ``active`` (n,); ``begin`` [s]; ``piece`` as `_Series`; ``switched`` is the neuron that
    switches at its end, or -1. A flow of more than neurons has further states and switches after theirs.
    """

    begin: float
    length: float
    active: Active
    terms: Array
    piece: _Series
    switched: int

    @property
    def step(self) -> float:
        """[s]"""
        return self.piece.step

    @property
    def end(self) -> float:
        """Time of the end [s]."""
        return self.begin + self.length * self.step

    def states(self, s: ArrayLike) -> Array:
        """Return the states (points, 2 n) at ``s`` in steps from the begin."""
        return np.vander(np.atleast_1d(np.asarray(s, dtype=float)), ORDER + 1, increasing=True) @ self.terms

    def outputs(self, readout: Array) -> Array:
        """Return the polynomials (rows, ORDER + 1) of ``readout`` (rows, n) times y."""
        n = readout.shape[1]
        return np.asarray((readout * self.active[:n]) @ self.terms[:, :n].T)

    def propagator(self) -> Array:
        """Return the derivative (2 n, 2 n) of the state at the end by the state at the begin."""
        full = self.piece.whole if self.length == 1 else self.piece.exponential(self.length)
        return full[:-1, :-1]


class Flow:
    """The exact flow of one network, from ``fastest`` [1/s] on.

    A subclass adds states, and switches of its own by ``_full_matrix``, ``gates`` and ``values``.
    """

    def __init__(self, network: Network) -> None:
        self.network = network
        self.fastest = max(1 / network.rise_time, 1 / network.adaptation_time)
        n, w = network.size, network.matrix
        d, rise, fatigue = network.adaptation, network.rise_time, network.adaptation_time
        linear = np.zeros((2 * n + 1, 2 * n + 1))
        linear[:n, :n] = -np.eye(n) / rise
        linear[:n, n : 2 * n] = -d * np.eye(n) / rise
        linear[n : 2 * n, n : 2 * n] = -np.eye(n) / fatigue
        linear[:n, -1] = network.tonics / rise
        outputs = np.zeros((2 * n + 1, n))
        outputs[:n] = -w / rise
        outputs[n : 2 * n] = np.eye(n) / fatigue
        self._linear, self._outputs = linear, outputs
        self._switches = n
        self._largest = 1 + float(np.abs(w).sum(axis=1).max())
        self._pieces: dict[bytes, _Series] = {}

    @cached_property
    def _room(self) -> int:
        m = len(self._linear)
        return max(2, int(_CACHE / ((ORDER + 1 if m <= _LARGEST_STACK else 2) * m**2 * 8)))

    def rate(self, state: Array) -> Array:
        """Return the derivative z' (2 n,) [1/s]."""
        n = self.network.size
        full = self._linear @ np.append(state, 1.0) + self._outputs @ np.maximum(state[:n], 0)
        return np.asarray(full[:-1])

    def gates(self, terms: Array, active: Active) -> Array:
        """Return the quantities (k, switches) whose signs switch, from ``terms`` (k, 2 n + 1) of a piece: the x."""
        return terms[:, : self.network.size]

    def values(self, z: Array) -> Array:
        """Return the quantities (switches,) whose signs switch, at ``z`` (2 n + 1,)."""
        return z[: self.network.size]

    def matrix(self, active: Active) -> Array:
        """Return A (2 n, 2 n) [1/s] of the piece in which just ``active`` neurons have x > 0."""
        return self._full_matrix(active)[:-1, :-1]

    def linear_piece(self, active: Active) -> tuple[Array, Array]:
        """Return A (m, m) and the constant b (m,) of z' = A z + b in the piece of just these ``active``."""
        a = self._full_matrix(active)
        return a[:-1, :-1], a[:-1, -1]

    def _full_matrix(self, active: Active) -> Array:
        a = self._linear.copy()
        a[:, : self.network.size] += self._outputs * active
        return a

    def stretches(self, state: Array, duration: float, begin: float = 0.0) -> Iterator[Stretch]:
        """Yield the motion from ``state`` (2 n,) over ``duration`` [s].

        Raises InputError if it grows without bound or takes more than `MOST_STEPS` steps, SolveError if switches
        accumulate at one moment (which was never observed).
        """
        n, switches = self.network.size, self._switches
        z = np.append(state, 1.0)
        scale = max(float(np.abs(state).max()), float(np.abs(self.network.tonics).max()))
        bound = _UNBOUNDED * scale * self._largest
        active = self._start(z)
        done, short, steps = 0.0, 0, 0
        while done < duration:
            steps += 1
            if steps > MOST_STEPS:
                raise _too_long(duration)
            piece = self._series(active)
            terms = piece.terms(z)
            length, who = _first_switch(self.gates(terms, active), active)
            left = (duration - done) / piece.step
            if length >= left:
                length, who = left, -1
            yield Stretch(begin + done, length, active, terms[:, :-1], piece, who)
            z = terms.sum(axis=0) if length == 1 else length**_EXPONENTS @ terms
            z[-1] = 1.0
            if not np.abs(z[:-1]).max() <= bound:
                raise InputError(
                    f"the outputs grow without bound ({np.abs(z).max():.1e} at {begin + done:.3g} s): the "
                    "weights excite more than adaptation and inhibition hold back; make the negative weights smaller"
                )
            if 0 <= who < n:
                z[who] = 0.0
            if who >= 0 or ((self.values(z) > 0) != active).any():  # the latter: a zero just on the end of a step
                active = self._start(z, active)
            short = short + 1 if length < 1e-9 else 0
            if short > 20 * switches:
                raise SolveError(f"neurons switch without end at {begin + done:g} s; vary the start a little")
            done = duration if length == left else done + length * piece.step

    def _series(self, active: Active) -> _Series:
        key = active.tobytes()
        if key in self._pieces:
            return self._pieces[key]
        if len(self._pieces) >= self._room:
            self._pieces.clear()
        a = self._full_matrix(active)
        step = 1 / _spectral_radius(np.abs(a[:-1, :-1]))
        a *= step
        rows = None
        if len(a) <= _LARGEST_STACK:
            series = np.empty((ORDER + 1, *a.shape))
            series[0] = np.eye(len(a))
            for k in range(1, ORDER + 1):
                series[k] = series[k - 1] @ a / k
            rows = series.reshape(-1, len(a))
        self._pieces[key] = _Series(step, a, rows)
        return self._pieces[key]

    def _ahead(self, z: Array, active: Active) -> Array:
        """Return a positive multiple (2 n + 1,) of the derivative z' in the piece of these ``active``."""
        known = self._pieces.get(active.tobytes())
        return (self._full_matrix(active) if known is None else known.matrix) @ z

    def _start(self, z: Array, before: Active | None = None) -> Active:
        """Return the neurons active just after ``z``: those with x > 0, and those at 0 that leave it upwards.

        At x = 0 the first derivative that is not zero decides. Its value does not depend on the neuron's own output,
        but it may on the others' that are at 0 as well, so the set is found by repetition.
        """
        count = np.arange(self._switches)
        x = self.values(z)
        at_zero = x == 0
        active = x > 0 if before is None else np.where(at_zero, before, x > 0)
        for _ in range(self._switches + 1):
            if not at_zero.any():
                break
            terms = self.gates(np.stack([z, self._ahead(z, active)]), active)
            if not terms[1, at_zero].all():
                terms = self.gates(self._series(active).terms(z), active)
            first = np.argmax(terms != 0, axis=0)
            rising = np.where(at_zero, terms[first, count] > 0, x > 0)
            if (rising == active).all():
                break
            active = rising
        return np.asarray(active)


def _spectral_radius(matrix: Array) -> float:
    """Return an upper bound, and a near one, of the spectral radius of a matrix of no negative numbers.

    For any positive v the largest (M v)_i/v_i is one (Collatz); powers of M bring v to where it is least.
    """
    v = np.ones(len(matrix))
    for _ in range(_POWERS):
        v = matrix @ v
        v = np.maximum(v / v.max(), 1e-200)
    return float((matrix @ v / v).max())


def _too_long(duration: float) -> InputError:
    return InputError(
        f"{duration:g} s takes more steps of the fastest time constant than the {MOST_STEPS} that are possible; "
        "shorten the duration or bring the time constants closer"
    )


def _first_switch(terms: Array, active: Active) -> tuple[float, int]:
    """Return when, in steps, and which of the polynomials ``terms`` (ORDER + 1, n) first meets zero; else (1, -1)."""
    sign = np.where(active, 1.0, -1.0)
    bernstein = sign[:, None] * (terms.T @ _BERNSTEIN)
    beyond = bernstein < 0
    if not beyond.any():
        return 1.0, -1
    crossing = np.flatnonzero(beyond.any(axis=1))
    earliest = np.argsort(beyond[crossing].argmax(axis=1), kind="stable")  # the most likely one is looked at first
    first, who, left = 1.0, -1, crossing[earliest].tolist()
    while left:
        i = left.pop(0)
        root = next(sign_changes(sign[i] * terms[:, i], first), None)
        if root is not None and (root < first or who < 0):
            first, who = root, i
            shorter = (terms[:, left].T * first**_EXPONENTS) @ _BERNSTEIN
            left = [k for k, met in zip(left, (sign[left, None] * shorter < 0).any(axis=1), strict=True) if met]
    return first, who


def sign_changes(polynomial: Array, length: float = 1.0) -> Iterator[float]:
    """Return the points in (0, ``length``) where the ``polynomial`` (ORDER + 1,) in s changes sign, ascending.

    By Descartes' rule Bernstein coefficients of one sign have no root between them, with one change of sign exactly
    one; with more the interval is halved. The root itself comes from the polynomial as given.
    """
    stack = [((polynomial * length**_EXPONENTS) @ _BERNSTEIN, 0.0, length)]
    while stack:
        b, low, high = stack.pop()
        signs = np.sign(b[b != 0])
        changes = int(np.count_nonzero(signs[1:] != signs[:-1]))
        if changes == 1:
            yield _root(polynomial, low, high, rising=bool(signs[0] < 0))
        elif changes and high - low > _TOUCH:
            left, right = _halved(b)
            middle = (low + high) / 2
            stack += [(right, middle, high), (left, low, middle)]


def _halved(b: Array) -> tuple[Array, Array]:
    """Return the coefficients on both halves of the interval, by De Casteljau's algorithm."""
    left, right = np.empty_like(b), np.empty_like(b)
    row = b
    for k in range(len(b)):
        left[k], right[-1 - k] = row[0], row[-1]
        row = (row[1:] + row[:-1]) / 2
    return left, right


def _root(polynomial: Array, low: float, high: float, rising: bool) -> float:
    """Return the one root between ``low`` and ``high`` by Newton's method, kept in its bracket by bisection."""
    coefficients = polynomial[::-1].tolist()
    s = (low + high) / 2
    for _ in range(100):
        value = rate = 0.0
        for c in coefficients:  # Horner, with the derivative
            rate = rate * s + value
            value = value * s + c
        if value == 0:
            break
        low, high = (s, high) if (value < 0) == rising else (low, s)
        following = s - value / rate if rate else low
        if not low < following < high:
            following = (low + high) / 2
        if abs(following - s) <= 2e-16 * s:
            return following
        s = following
    return s


def sampled(flow: Flow, state: Array, times: Array, progress: Callable[[float], None] | None = None) -> Array:
    """Return the states (times, 2 n) of the motion from ``state`` at ``times`` [s], ascending from >= 0."""
    result = np.empty((len(times), len(state)))
    result[times <= 0] = state
    k = int(np.searchsorted(times, 0.0, side="right"))
    if k == len(times):
        return result
    if not times[-1] * flow.fastest <= MOST_STEPS:  # steps are shorter than these
        raise _too_long(float(times[-1]))
    for stretch in flow.stretches(state, float(times[-1])):
        upto = int(np.searchsorted(times, stretch.end, side="right"))
        if upto > k:
            result[k:upto] = stretch.states((times[k:upto] - stretch.begin) / stretch.step)
            k = upto
        if progress:
            progress(stretch.end)
    if k < len(times):  # the last sample is the end, to rounding
        result[k:] = stretch.states(stretch.length)
    return result
