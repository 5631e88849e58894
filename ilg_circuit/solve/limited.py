"""Solves a linear circuit whose source of current gives way at a voltage limit, exactly, from event to event.

The source forces the drive's current i through the circuit as long as abs(v) is below the limit U. There it holds the
voltage, and gives the current that the circuit then takes, until that would be more than the drive's. Both are linear
systems of the same states: v = C x + D i, so that at the limit i = (U - C x)/D takes the place of the drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array, one_thread
from ..circuit.netlist import Netlist
from ..drive import Drive
from ..errors import InputError, SolveError, argument
from .exact import augmented
from .grid import smooth_intervals
from .propagators import Halves, Propagators
from .sampling import relative
from .state_space import StateSpace, state_space
from .waves import drive_at, drive_lines
from .work import Work, gauss, powers

#: Part of limit and drive by which either may be exceeded before it counts.
_TOLERANCE = 1e-11
#: Most events of a run.
_MOST_EVENTS = 20_000

#: Number of samples at which rounding is estimated, and factor for the others.
_COMPARED, _LIKELY = 40, 10.0

_FRACTIONS, _WEIGHTS = gauss(5)
_POINTS = np.append(_FRACTIONS, 1.0)


@one_thread()
def limited_run(
    nets: Sequence[Netlist], drive: Drive, limit: float, times: Array, works: Sequence[Work], engine: str
) -> tuple[Array, Array, tuple[str, ...]]:
    """Return outputs and works (1, outputs + works, t), their errors (1, outputs + works) and their names.

    The errors are by how much another order of the elements moves them; those of probes are not judged. Raises
    InputError for an ``engine`` other than exact, several netlists, a nonlinear one, or a rest that is not zero.
    """
    if engine != "exact":
        raise InputError(f"a source with a limit is solved by the exact engine only; use {argument('engine', 'exact')}")
    if not nets[0].linear or drive.rest or len(nets) > 1:
        raise InputError(
            "a source with a limit is solved for one linear strip from rest; leave limit= out, or the strip's "
            "emission_voltage and capacitance_slope"
        )
    system, other = (state_space([replace(nets[0], elements=nets[0].elements[::step])]) for step in (1, -1))
    values = limited_with_work(system, drive, limit, times, works)[0]
    some = np.unique(np.linspace(0, len(times) - 1, _COMPARED).astype(int))
    again = limited_with_work(other, drive, limit, times[some], works)[0]
    errors = _LIKELY * (relative(again - values[..., some], values[..., some]) + 5e-14)
    judged = [*(not output.probe for output in nets[0].outputs), *(not work.probe for work in works)]
    names = (*system.output_names, *(work.name for work in works))
    return values, np.where(judged, errors, 0.0), names


def limited_with_work(
    system: StateSpace, drive: Drive, limit: float, times: Array, works: Sequence[Work]
) -> tuple[Array, Array]:
    """Return the outputs of one circuit driven by current, and works, (1, outputs + works, t), and the events [s].

    ``limit`` [V] is that of the source; ``times`` [s] ascend from 0 on; a sample on a jump is the right limit. An event
    is where the source gives way or takes over again. Raises SolveError for more than 20000 of them.
    """
    run = _Run(system, drive, limit)
    poles = np.concatenate([np.linalg.eigvals(matrix) for matrix in run.matrices.values()])
    end = float(times[-1]) or 1e-300
    intervals = smooth_intervals(poles, drive, end)
    grid = np.union1d(np.append(0.0, times), intervals[intervals <= times[-1]])
    widths = np.diff(grid)
    run.plan(widths)
    lines = np.append(drive_lines(drive, grid[:-1], widths), drive_at(drive, grid[-1:]), axis=1)
    at_start = np.empty((len(grid), run.outputs))
    total = np.zeros((len(grid), len(works)))
    for k, start in enumerate(grid.tolist()):
        run.begin(start, lines[:, k])
        at_start[k] = run.shown()
        if k == len(widths):
            break
        total[k + 1] = total[k]
        for width, points in run.through(k):
            shown = points.T[None]
            # what the source gives, which is not the drive at the limit
            power = powers(works, system.output_names, points[:, run.current], shown)
            total[k + 1] += width * power[0] @ _WEIGHTS
    asked = np.searchsorted(grid, times)
    values = np.concatenate([at_start[asked], total[asked]], axis=1).T[None]
    if not np.isfinite(values).all():
        raise SolveError("the exact engine's result is not finite: a value of the actuator is implausible")
    return values, np.array(run.events)


class _Run:
    """A run in progress: its state, and whether the source gives way: ``mode`` 0 no, 1 at +limit, -1 at -limit."""

    def __init__(self, system: StateSpace, drive: Drive, limit: float) -> None:
        matrix, output = (array[0] for array in augmented(system, [drive.angular_frequency()]))
        self.outputs = len(output)
        self.current, voltage = (system.output_names.index(name) for name in ("current", "voltage"))
        self._limit, self._states = limit, system.a.shape[1]
        source = self._states  # the place of the drive
        direct = float(output[voltage, source])
        if not direct > 0:
            raise SolveError("a limit of the source needs a circuit with a resistance at high frequencies")
        self.matrices, self._shown, self._guards = {0: matrix}, {0: output}, {0: output[voltage]}
        for mode in (1, -1):
            # the current at the limit, of the states and the constant 1
            taken = -output[voltage] / direct
            taken[source] = 0.0
            taken[-1] += mode * limit / direct
            held = np.zeros_like(matrix[source])
            held[source] = 1.0
            self.matrices[mode] = matrix + np.outer(matrix[:, source], taken - held) * self._of_circuit(matrix)
            self._shown[mode] = output + np.outer(output[:, source], taken - held)
            self._guards[mode] = mode * (held - taken)
        self._scale = {0: limit, 1: drive.largest(), -1: drive.largest()}
        self.mode, self.time, self.events = 0, 0.0, list[float]()
        self._z = np.zeros(len(matrix))
        self._z[-1] = 1.0

    def plan(self, widths: Array) -> None:
        """Prepare for intervals of ``widths`` [s] in a row."""
        self._widths = widths
        self._planned = {mode: Propagators(matrix[None], widths, _POINTS) for mode, matrix in self.matrices.items()}
        longest = float(widths.max(initial=0.0))
        self._halves = {mode: Halves(matrix[None], longest) for mode, matrix in self.matrices.items()}

    def _of_circuit(self, matrix: Array) -> Array:
        """Return 1 for the rows of the circuit's states, 0 for those of the drive."""
        rows = np.zeros((len(matrix), 1))
        rows[: self._states] = 1.0
        return rows

    def begin(self, time: float, line: Array) -> None:
        """Begin an interval with the drive and its companion there; after a jump the source may change its mode."""
        self.time, self._z[self._states : self._states + 2] = time, line
        self._settle()

    def shown(self) -> Array:
        """Return the outputs now."""
        return np.asarray(self._shown[self.mode] @ self._z)

    def through(self, interval: int) -> list[tuple[float, Array]]:
        """Go through an interval; return the pieces between events, with the outputs (points, outputs) within."""
        pieces: list[tuple[float, Array]] = []
        width = float(self._widths[interval])
        while width > 0:
            if pieces:
                states = self._after(width * _POINTS)
            else:
                states = self._planned[self.mode].after(interval, self._z[None, :, None])[0]
            excess = self._excess(states)
            bad = int(np.argmax(excess > 0)) if (excess > 0).any() else None
            piece = width
            if bad is not None:
                piece = self._event(width * (_POINTS[bad - 1] if bad else 0.0), width * _POINTS[bad])
                states = self._after(piece * _POINTS)
            pieces.append((piece, np.asarray(states[:-1] @ self._shown[self.mode].T)))
            self._z = states[-1]
            self.time += piece
            width -= piece
            if bad is not None:
                self._switch()
        return pieces

    def _excess(self, states: Array) -> Array:
        """Return by how much states (points, all) exceed what their mode allows; negative where it goes on."""
        value = states @ self._guards[self.mode]
        beyond = np.abs(value) - self._limit if self.mode == 0 else -value
        return np.asarray(beyond - _TOLERANCE * self._scale[self.mode])

    def _event(self, low: float, high: float) -> float:
        """Return when, between two times [s] from now, the mode ends."""
        from scipy.optimize import brentq

        def excess(t: float) -> float:
            return float(self._excess(self._after(np.array([t])))[0])

        if excess(low) >= 0:
            return low
        return float(brentq(excess, low, high, xtol=1e-14 * max(high, self.time), rtol=1e-14))

    def _switch(self) -> None:
        self.events.append(self.time)
        if len(self.events) > _MOST_EVENTS:
            raise SolveError(f"the source reaches its limit more than {_MOST_EVENTS / 2:.0f} times; shorten the run")
        self.mode = 0 if self.mode else (1 if float(self._guards[0] @ self._z) > 0 else -1)

    def _settle(self) -> None:
        """Change the mode until it is one that goes on."""
        for _ in range(3):
            if self._excess(self._z[None])[0] <= 0:
                return
            self._switch()

    def _after(self, widths: Array) -> Array:
        """Return the states (points, all) after ``widths`` [s] (points,), none longer than the longest interval."""
        halves, now = self._halves[self.mode], self._z[None, :, None]
        return np.stack([halves.after(width, now)[0, :, 0] for width in widths.tolist()])
