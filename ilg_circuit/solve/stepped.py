"""Solves netlists by ngspice to a stated accuracy, many at once.

ngspice integrates by the trapezoidal rule on a grid designed from the circuit's poles (`ilg_circuit.solve.grid`), then
again with every step split in two, three and more. Because each of these grids is an even subdivision of the first,
the error at its nodes is a series in even powers of the step, and Richardson extrapolation removes one term a run. Runs
are added, and then the grid is refined, until the error is that asked for. What the last run moved is the error of the
runs before it; the stated error is between that and what the next one would move, and has what all runs share: how
long a jump takes, and rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray
from ..circuit.netlist import Netlist, Output, copies
from ..drive import Drive, by_current
from ..errors import SolveError, StoppedEarlyError
from .grid import Grid, design_grid
from .modes import modes_of
from .sampling import at_samples, relative, zero_between
from .state_space import StateSpace
from .work import Work, on_grid, powers

_MOST_RUNS = 4
_MOST_REFINEMENTS = 4
#: Largest number of refinements with a kink in a law (a charge that passes zero), where halving the steps gains less.
_MOST_REFINEMENTS_NONLINEAR = 8
#: Least factor by which halving the steps reduces errors, unless they are rounding.
_GAIN = 3.0
#: Rounding of a run, relative to the largest term of an output: what thousands of steps make of a double's 1e-16, at
#: most, and what is to be reckoned with in any.
_ROUNDING, _NOISE = 1e-11, 3e-13
#: The same for a step and one before it that is shorter, by their ratio.
_NOISE_UNEVEN = 3e-15
#: Rounding of a nonlinear run, by Newton's iterations.
_NOISE_NONLINEAR = 1e-10
#: Accuracy above which a linear circuit's grid is coarse enough to gain by nodes at the samples.
_COARSE = 1e-6
#: Factor by which nodes between the samples of a nonlinear circuit must be fewer, since its poles may be others later.
_TRIED = 8.0
#: Factor by which the error of a smooth nonlinear circuit must be smaller than allowed, for it to be solved once only.
_UNCHECKED = 3.0
#: Laws with a kink at zero.
_KINKED = ("charge", "bent")
#: Factor by which halving the steps reduces an error at a kink between nodes.
_HALVED = 8.0
#: Least charge before or after it passes zero, relative to its largest value; smaller ones are rounding about zero.
_FELT = 1e-9
#: Length of a run, in time constants of the fastest mode, above which it is stiff.
_STIFF = 3e3
#: Power of the step with which the errors of a stiff run fall at least. Factor by which a grid is finer than this or
#: the extrapolation's order demands, and its bounds.
_ORDER_STIFF, _FINER, _FINER_BOUNDS = 4, 1.2, (1.5, 6.0)
#: Factor by which steps are shorter for an answer that needs a run less, and the same where a run is stiff; number of
#: nodes in this case over the usual one up to which it costs less: four runs take ten steps for each, three six.
_EARLIER, _OF_FEWER_RUNS = (1.6, 2.2), 10 / 6
#: Factor by which the stated error exceeds the estimate.
_CAREFUL = 1.5
#: Factors by which the jumps of a drive take longer, one after the other, where ngspice stops in them.
_LONGER_JUMPS = (1.0, 10.0, 100.0)
#: What voltages of a nonlinear circuit need not settle by where ngspice stops all the same, relative to the drive; it
#: is less than the noise that is stated.
_SETTLED = 1e-11


class Batch:
    """Netlists of one topology and of similar time constants, solved together on one shared grid.

    Its answers are to an ``accuracy``, relative to each waveform's largest value; ``works`` as for `transient`.
    """

    def __init__(
        self, nets: list[Netlist], drive: Drive, accuracy: float, works: Sequence[Work], system: StateSpace
    ) -> None:
        self._own = len(nets[0].outputs)
        # after them the charges whose law has a kink at zero
        kinks = tuple(
            Output(f"charge of {e.name}", "C", ((f"v({e.nodes[2]})", 1.0),), probe=True)
            for e in nets[0].elements
            if e.law == "charge"
        )
        nets = [replace(netlist, outputs=netlist.outputs + kinks) for netlist in nets]
        circuit, self._vectors = copies(nets)
        self._nets, self._drive, self._accuracy, self._linear = nets, drive, accuracy, nets[0].linear
        self._works, self._kinks = works, len(kinks)
        self._smooth = not any(e.law in _KINKED for e in nets[0].elements)
        self._modes = modes_of(system) if self._linear else None
        self._direct = system.d[..., :-1] if self._linear else None
        self._text = "\n".join([circuit, *(source.line("external") for source in nets[0].sources)])
        self._vector_names = list(dict.fromkeys(v for of_copy in self._vectors for v in of_copy.values()))
        self._names = [output.name for output in nets[0].outputs]
        self._judged = [*(not output.probe for output in nets[0].outputs), *(not work.probe for work in works)]

    def solved(self, poles: ComplexArray, samples: Array, acceptable: float, interpolate: bool) -> tuple[Array, Array]:
        """Return values (n, outputs, t) and errors (n, outputs), refined until accurate, or at last ``acceptable``.

        Modes of a linear circuit that a drive's corners hardly excite take no steps, unless its error stays too large
        so: a jump before may excite them.
        """
        if self._linear:
            try:
                return self._in_jumps(poles, samples, acceptable, interpolate, faint=True)
            except StoppedEarlyError:
                raise
            except SolveError:
                if not len(self._drive.breakpoints(float(samples[-1]))):
                    raise
        return self._in_jumps(poles, samples, acceptable, interpolate, faint=False)

    def _in_jumps(
        self, poles: ComplexArray, samples: Array, acceptable: float, interpolate: bool, *, faint: bool
    ) -> tuple[Array, Array]:
        """Return what `solved` does, with steps for modes that corners hardly excite unless these are ``faint``.

        ngspice may stop in the short steps of a jump of the drive: longer ones are tried then. And in those of fast
        modes, where a nonlinear circuit's voltages do not settle to their last digits: a few more are left open then.
        """
        jumps = _LONGER_JUMPS if len(self._drive.jumps(float(samples[-1]))) else _LONGER_JUMPS[:1]
        largest = 1.0 if by_current(self._drive) else self._drive.largest()
        settled = (None,) if self._linear else (None, _SETTLED * largest)
        *tried, last = ((longer, left) for left in settled for longer in jumps)
        for how in tried:
            with suppress(StoppedEarlyError):
                return self._refined(poles, samples, acceptable, interpolate, *how, faint)
        return self._refined(poles, samples, acceptable, interpolate, *last, faint)

    def _refined(
        self,
        poles: ComplexArray,
        samples: Array,
        acceptable: float,
        interpolate: bool,
        longer: float,
        settled: float | None,
        faint: bool,
    ) -> tuple[Array, Array]:
        """Return what `_in_jumps` does, with jumps of the drive that take ``longer`` than usual by this factor.

        Voltages of a nonlinear circuit need not settle by less than ``settled`` [V].
        """
        accuracy = self._accuracy
        theta = min(0.4 * (accuracy / 1e-7) ** (1 / 6), 0.8)
        between_nodes = min(0.17 * (accuracy / 1e-6) ** (1 / 7), theta)  # interpolation wants closer nodes
        jumps: Any = {"linear": self._linear, "longer": longer, "faint": faint}
        one_each = jumps | {"interpolate": False}
        grid: Grid | None = None
        coarser: Array | None = None
        fastest = float(np.abs(poles).max(initial=0.0))
        stiff = bool(fastest * samples[-1] > _STIFF)
        best, least = (np.empty(0), np.empty(0), np.inf), np.inf
        bends = np.empty(0)
        for _ in range(_MOST_REFINEMENTS if self._linear else _MOST_REFINEMENTS_NONLINEAR):
            if grid is None:
                fineness = between_nodes if interpolate else theta
                grid = design_grid(poles, self._drive, samples, fineness, interpolate=interpolate, **jumps)
                if interpolate and (not self._linear or accuracy > _COARSE):
                    # which saves nodes at the samples, but costs more than these where they are few beside others
                    other = design_grid(poles, self._drive, samples, theta, **one_each)
                    interpolate = len(grid.nodes) < len(other.nodes) / (1.0 if self._linear else _TRIED)
                    grid = grid if interpolate else other
                if self._linear and not interpolate:  # where these are samples, closer ones save a run
                    finer_grid = design_grid(poles, self._drive, samples, theta / _EARLIER[stiff], **one_each)
                    grid = finer_grid if len(finer_grid.nodes) < _OF_FEWER_RUNS * len(grid.nodes) else grid
            solved_on = grid.bent(bends)
            at_nodes, errors, allowed = self._extrapolated(solved_on, settled, stiff=stiff)
            values, doubt = at_samples(solved_on, at_nodes, self._drive, self._direct)
            doubt = np.where(self._judged, doubt, 0.0)
            errors = np.maximum(errors, doubt) + self._jump_errors(solved_on, fastest, at_nodes)
            if not self._linear and self._smooth and (_UNCHECKED * errors <= allowed).all():
                errors = np.where(self._judged, errors + _NOISE_NONLINEAR, 0.0)
            elif not self._linear:
                # a kink in a law invalidates the extrapolation: twice the number of steps must give the same result
                moved = np.inf if coarser is None else relative(values - coarser, values)
                # hardly more than what it moved, and no less than rounding and the eighth that a kink leaves
                bends, before = self._zeros(solved_on, at_nodes), bends
                # kinks that are found elsewhere than the nodes they were given spoil a run as steps over them do
                halved = _HALVED if solved_on.near(bends, before) else 1.0
                likely = np.maximum(np.minimum(errors, 3 * moved), moved / halved) + _NOISE_NONLINEAR
                errors, coarser = np.where(self._judged, likely, 0.0), values
            passed, worst = (errors <= allowed).all(), float(errors.max())
            if passed or worst < least:
                # stated relative to what was asked for, which may leave out the peak
                shown, peak = (np.abs(found).max(axis=2) for found in (values, at_nodes))
                best = values, errors * np.divide(peak, shown, out=np.ones_like(peak), where=shown > 0), worst
            if passed or (self._linear and worst > least / _GAIN):
                break  # good enough, or nothing but rounding, which a finer grid makes larger
            least = min(worst, least)
            if interpolate and (doubt > allowed).any():
                # closer nodes (interpolation's error goes with the sixth power), unless every sample may as well be one
                closer = 1.2 * float(doubt.max() / accuracy) ** (1 / 6)
                between_nodes /= closer
                interpolate = closer * len(grid.nodes) < len(samples) / 2
                grid = None
            elif self._linear:
                wanted = _FINER * (worst / accuracy) ** (1 / (_ORDER_STIFF if stiff else 2 * _MOST_RUNS))
                finer = float(np.clip(wanted, *_FINER_BOUNDS))
                theta, between_nodes, grid = theta / finer, between_nodes / finer, None
            else:
                grid = grid.halved()
        values, errors, worst = best
        if passed or worst <= acceptable:
            return self._given(values), self._given(errors)
        raise SolveError(
            f"ngspice reached an error of {worst:.1e} of the maximum, not the {acceptable:.1e} asked for; "
            "shorten the run, ask for less accuracy where a command lets you, or use the exact engine"
        )

    def _jump_errors(self, grid: Grid, fastest: float, at_nodes: Array) -> Array:
        """Return errors (n, outputs) by the length of jumps: in each mode, times the mode's share of an output.

        Works have that of the worst output; a nonlinear circuit that of its ``fastest`` mode [1/s].
        """
        errors = np.full(at_nodes.shape[:2], float(grid.jump_error(np.array(fastest))))
        if self._modes is not None and errors.any():
            in_modes = grid.jump_error(np.abs(self._modes.poles))
            left = 2 * self._drive.largest() * np.einsum("nos,ns->no", self._modes.shares, in_modes)
            own = left.shape[1]
            peak = np.abs(at_nodes[:, :own]).max(axis=2)
            parts = np.divide(left, peak, out=np.zeros_like(left), where=peak > 0)
            errors[:, :own] = np.minimum(parts, errors[:, :own])
            errors[:, own:] = (parts * self._judged[:own]).max(axis=1, keepdims=True)
        return np.where(self._judged, errors, 0.0)

    def _given(self, found: Array) -> Array:
        """Return the netlist without the outputs that the batch added."""
        return np.delete(found, np.s_[self._own : self._own + self._kinks], axis=1)

    def _extrapolated(self, grid: Grid, settled: float | None, *, stiff: bool) -> tuple[Array, Array, Array]:
        """Return the outputs and works at the grid's nodes after 0, their errors, and those allowed.

        By Richardson extrapolation; errors are relative. Allowed is the accuracy, or the rounding of an output that is
        a small difference of large quantities. In a ``stiff`` circuit the fastest modes, over which steps grow, make
        the runs' differences uneven.
        """
        from .ngspice import session

        columns: list[Array] = []  # Neville's scheme: columns[j] has been extrapolated j times
        noise = max(_NOISE, _NOISE_UNEVEN * grid.unevenness)
        before: Array | float = np.inf
        end, vectors = float(grid.nodes[-1]), self._vector_names
        with session().loaded(self._text, end, vectors, linear=self._linear, settled=settled) as run:
            for parts in range(1, _MOST_RUNS + 1):
                points = grid.subdivided(parts)
                voltages = grid.voltages(self._drive, points)
                previous, (found, terms) = columns, self._found(grid, parts, run(points, voltages), voltages)
                columns = [found]
                for j, older in enumerate(previous, 1):
                    ratio = (parts / (parts - j)) ** 2
                    columns.append(columns[-1] + (columns[-1] - older) / (ratio - 1))
                if parts > 1:
                    # what the last run moved is the error of those before it; that of all goes on as fast as these fell
                    moved = self._errors(columns[-1] - previous[-1], columns[-1])
                    rounding = self._errors(terms, columns[-1])
                    ahead = moved * np.minimum(moved / np.maximum(before, 1e-300), 1.0)
                    errors = _CAREFUL * np.sqrt(moved * np.maximum(ahead, noise * rounding)) + noise * rounding
                    errors = np.maximum(errors, self._errors(columns[-1] - columns[-2], columns[-1]))
                    before = moved
                    if stiff:
                        errors = np.maximum(errors, moved)
                    if (errors <= self._accuracy).all():
                        break
        allowed = np.maximum(self._accuracy, _ROUNDING * rounding if parts == _MOST_RUNS else 0.0)
        return columns[-1], errors, allowed

    def _found(self, grid: Grid, parts: int, raw: Array, voltages: Array) -> tuple[Array, Array]:
        """Return outputs and works at the grid's nodes after 0 from a run's vectors, and the sizes of their terms."""
        nodes = np.cumsum(grid.parts(parts)) - 1
        at_nodes, terms = self._outputs(raw[:, nodes]), self._outputs(np.abs(raw[:, nodes]), absolute=True)
        if not self._works:
            return at_nodes, terms
        power = powers(self._works, self._names, voltages[..., 1:], self._outputs(raw))
        work = on_grid(grid, parts, power)
        return np.concatenate([at_nodes, work], axis=1), np.concatenate([terms, np.abs(work)], axis=1)

    def _outputs(self, raw: Array, *, absolute: bool = False) -> Array:
        """Return the outputs (n, outputs, points) as sums of ngspice's vectors; ``absolute``: of the terms' sizes."""
        row = {name: k for k, name in enumerate(self._vector_names)}
        result = np.zeros((len(self._nets), len(self._names), raw.shape[1]))
        for j, output in enumerate(self._nets[0].outputs):
            for term, (quantity, _) in enumerate(output.terms):
                coefficients = np.array([netlist.outputs[j].terms[term][1] for netlist in self._nets])
                if coefficients.any():
                    rows = [row[of_copy[quantity]] for of_copy in self._vectors]
                    result[:, j] += (np.abs(coefficients) if absolute else coefficients)[:, None] * raw[rows]
        return result

    def _zeros(self, grid: Grid, at_nodes: Array) -> Array:
        """Return the times [s] at which a charge with a kink at zero passes it, in any of the netlists."""
        found = []
        for charge in at_nodes[:, self._own : self._own + self._kinks].reshape(-1, at_nodes.shape[2]):
            felt = np.maximum(np.abs(charge[:-1]), np.abs(charge[1:])) > _FELT * np.abs(charge).max()
            for k in np.flatnonzero((charge[:-1] * charge[1:] < 0) & felt) + 1:
                # the piece that the step lies in; of a jump, the one before it
                first, last = next((a, b) for a, b in reversed(grid.segments) if a <= k)
                near = slice(max(k - 2, first, 1), min(k + 3, last) + 1)
                t, q = grid.nodes[near], charge[near.start - 1 : near.stop - 1]
                left, right = grid.nodes[k], grid.nodes[k + 1]
                if len(t) > 1:
                    found.append(zero_between(t, q, left, right))
        return np.unique(found)

    def _errors(self, difference: Array, values: Array) -> Array:
        """Return the largest difference over largest value (n, outputs); 0 for what is not judged."""
        return np.where(self._judged, relative(difference, values), 0.0)
