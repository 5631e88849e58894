"""Transients to a stated accuracy: many netlists at once, by ngspice or exactly.

ngspice integrates by the trapezoidal rule on a grid designed from the circuit's poles (`ilg_circuit.solve.grid`), then
again with every step split in two, three and more. Because each of these grids is an even subdivision of the first,
the error at its nodes is a series in even powers of the step, and Richardson extrapolation removes one term a run. Runs
are added, and then the grid is refined, until the last two extrapolations agree to the accuracy asked for; their
difference bounds the error of the weaker one, and is the stated error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, ComplexArray
from ..circuit.netlist import Netlist, copies
from ..drive import Drive, PiecewiseLinear, drive_times
from ..errors import InputError, SolveError
from .grid import Grid, design_grid
from .state_space import StateSpace, state_space

Progress = Callable[[int, int], None]

#: Accuracy a caller gets who asks for none: error relative to each waveform's largest value.
DEFAULT_ACCURACY = 1e-7

_MOST_RUNS = 4
_MOST_REFINEMENTS = 4
#: Where a law has a kink (a charge that passes zero) halving the steps gains less.
_MOST_REFINEMENTS_NONLINEAR = 8
_LARGEST_BATCH = 100
#: Rounding of a run, relative to the largest term of an output: what thousands of steps make of a double's 1e-16.
_ROUNDING = 1e-11
#: Copies in one netlist share one grid; their fastest modes may differ by this factor.
_SPREAD = 3.0
#: Nodes of the interpolation used and of the weaker one that it is compared with.
_INTERPOLATION_NODES = (8, 6)
#: Near the ends both are one-sided, and their difference may fall short of the error by some parts in a hundred.
_CAUTION = 1.5


@dataclass(frozen=True)
class Waveforms:
    """Outputs of ``n`` netlists at the same times.

    ``times`` [s] (t,); ``values`` (n, outputs, t) in the outputs' units; ``errors`` (n, outputs): estimated error
    relative to the waveform's largest value (0 for the exact engine); ``engine`` says what solved it.
    """

    times: Array
    values: Array
    errors: Array
    names: tuple[str, ...]
    engine: str

    def output(self, name: str, copy: int = 0) -> Array:
        """One waveform (t,)."""
        return np.asarray(self.values[copy, self.names.index(name)])


def transient(
    netlists: Netlist | Sequence[Netlist],
    drive: Drive,
    times: ArrayLike,
    *,
    engine: str = "ngspice",
    accuracy: float = DEFAULT_ACCURACY,
    acceptable: float | None = None,
    interpolate: bool = True,
    progress: Progress | None = None,
) -> Waveforms:
    """Solve netlists of one topology under ``drive`` from its rest, and sample their outputs at ``times`` [s].

    ``accuracy`` is the error allowed, relative to each waveform's largest value (1e-11 to 1e-2). A sample at t = 0 or
    on an edge of the drive is the right limit. ``acceptable`` is an error that is a result too where the accuracy is
    not reached (default: none beyond it). ``interpolate=False`` makes every sample a point of the solve.
    ``progress(done, total)`` is called after each piece of work. Raises InputError for times that are not ascending
    and >= 0, SolveError when the accuracy is not reached.
    """
    nets = [netlists] if isinstance(netlists, Netlist) else list(netlists)
    if not nets:
        raise InputError("a transient needs at least one netlist")
    samples = sampled_times(drive, times)
    if not 1e-11 <= accuracy <= 1e-2:
        raise InputError(f"accuracy {accuracy:g} must lie between 1e-11 and 1e-2")
    if engine == "ngspice" and samples[-1] in drive.jumps(np.inf):
        # a jump on the last sample: its right limit needs a run that goes beyond
        beyond = transient(
            nets, drive, np.append(samples, samples[-1] * 1.001), engine=engine, accuracy=accuracy,
            acceptable=acceptable, interpolate=interpolate, progress=progress,
        )  # fmt: skip
        return replace(beyond, times=samples, values=beyond.values[:, :, :-1])
    if drive.rest != nets[0].rest and not nets[0].linear:
        raise InputError(f"the circuit starts at rest under {nets[0].rest:g} V, the drive from {drive.rest:g} V")
    system = state_space([netlist.linearised() for netlist in nets])
    if drive.rest and nets[0].linear:
        assert isinstance(drive, PiecewiseLinear)
        moved = transient(
            nets, drive.from_rest(), samples, engine=engine, accuracy=accuracy,
            acceptable=acceptable, interpolate=interpolate, progress=progress,
        )  # fmt: skip
        return replace(moved, values=moved.values + drive.rest * system.steady()[..., None])
    if engine == "exact":
        from .exact import exact_outputs

        if not nets[0].linear:
            raise InputError("the exact engine solves linear circuits only, and this one is not; use --engine ngspice")

        values = exact_outputs(system, drive, samples)
        return Waveforms(samples, values, np.zeros(values.shape[:2]), system.output_names, "exact")
    if engine != "ngspice":
        raise InputError(f"engine is '{engine}'; choose ngspice or exact")
    if samples[-1] == 0:
        # only the start is asked for: one point later there is something to solve
        longer = transient(nets, drive, [0.0, 1e-6 / fastest_modes(system).max()], engine=engine, accuracy=accuracy)
        return Waveforms(samples, longer.values[:, :, :1], longer.errors, longer.names, longer.engine)
    poles = system.poles()
    if not nets[0].linear:  # the grid must suit the modes at rest and those at the drive's peak
        at_peak = state_space([netlist.linearised(drive.largest()) for netlist in nets])
        poles = np.concatenate([poles, at_peak.poles()], axis=1)
    values = np.empty((len(nets), len(system.output_names), len(samples)))
    errors = np.empty(values.shape[:2])
    done = 0
    for members in similar(fastest_modes(system)):
        batch = _Batch([nets[k] for k in members], drive, accuracy)
        found = batch.solved(poles[members].ravel(), samples, acceptable or accuracy, interpolate)
        values[members], errors[members] = found
        done += len(members)
        if progress:
            progress(done, len(nets))
    return Waveforms(samples, values, errors, system.output_names, "ngspice")


def sampled_times(drive: Drive, times: ArrayLike) -> Array:
    """Return ``times`` [s] (t,), on the edges of the drive where only rounding parts them.

    Raises InputError unless they are one row of finite, ascending numbers from zero on.
    """
    samples: Array = np.asarray(times, dtype=np.float64)
    if samples.ndim != 1 or not len(samples):
        raise InputError("a transient needs at least one time")
    if not np.isfinite(samples).all() or samples[0] < 0 or (np.diff(samples) <= 0).any():
        raise InputError("the times of a transient must be finite, ascending and not negative")
    return drive_times(drive, samples)


def fastest_modes(system: StateSpace) -> Array:
    """Magnitude [1/s] of the fastest pole of each netlist (n,); next to nothing where there is none."""
    return np.asarray(np.abs(system.poles()).max(axis=1, initial=1e-300))


def similar(fastest: Array) -> list[NDArray[np.intp]]:
    """Group netlists of similar time constants: one fast member would slow all others."""
    order = np.argsort(fastest, kind="stable")
    batches, start = [], 0
    for k in range(1, len(order) + 1):
        full = k - start == _LARGEST_BATCH
        if k == len(order) or full or fastest[order[k]] > _SPREAD * fastest[order[start]]:
            batches.append(order[start:k])
            start = k
    return batches


class _Batch:
    """Netlists of one topology and of similar time constants, solved together on one shared grid."""

    def __init__(self, nets: list[Netlist], drive: Drive, accuracy: float) -> None:
        circuit, self._vectors = copies(nets)
        self._nets, self._drive, self._accuracy, self._linear = nets, drive, accuracy, nets[0].linear
        self._text = f"{circuit}\n{nets[0].source.line('external')}"
        self._names = list(dict.fromkeys(v for of_copy in self._vectors for v in of_copy.values()))
        self._judged = [not output.probe for output in nets[0].outputs]

    def solved(self, poles: ComplexArray, samples: Array, acceptable: float, interpolate: bool) -> tuple[Array, Array]:
        """Values (n, outputs, t) and errors (n, outputs), refined until accurate, or ``acceptable`` in the end."""
        accuracy = self._accuracy
        theta = min(0.4 * (accuracy / 1e-7) ** (1 / 6), 0.8)
        between_nodes = min(0.17 * (accuracy / 1e-6) ** (1 / 7), theta)  # interpolation wants closer nodes
        coarser: Array | None = None
        previous: Array | None = None
        earlier: Array | None = None
        for _ in range(_MOST_REFINEMENTS if self._linear else _MOST_REFINEMENTS_NONLINEAR):
            fineness = between_nodes if interpolate else theta
            grid = design_grid(poles, self._drive, samples, fineness, interpolate=interpolate, linear=self._linear)
            at_nodes, errors, allowed = self._extrapolated(grid)
            values, doubt = _sample(grid, at_nodes)
            errors, doubt = (np.where(self._judged, e, 0.0) for e in (np.maximum(errors, doubt), doubt))
            passed = (errors <= allowed).all()
            if passed and not self._linear:
                # a kink in a law spoils the series that is extrapolated: a finer grid must give the same answer
                moved = np.inf if coarser is None else _relative(values - coarser, values)
                errors, coarser = np.maximum(errors, np.where(self._judged, moved, 0.0)), values
                passed = (errors <= allowed).all()
            if passed:
                return values, errors
            previous, earlier = earlier, values
            if interpolate and (doubt > allowed).any():
                # closer nodes (interpolation's error goes with the sixth power), unless every sample may as well be one
                closer = 1.2 * float(doubt.max() / accuracy) ** (1 / 6)
                between_nodes /= closer
                interpolate = closer * len(grid.nodes) < len(samples) / 2
            else:
                theta, between_nodes = theta / 2, between_nodes / 2
        if not self._linear and previous is not None:  # the kink counts here too, though no grid has passed
            errors = np.maximum(errors, self._errors(values - previous, values))
        if errors.max() <= acceptable:
            return values, errors
        raise SolveError(
            f"ngspice reached an error of {errors.max():.1e} of the maximum, not the {acceptable:.1e} asked for; "
            "shorten the run, ask for less accuracy where a command lets you, or use the exact engine"
        )

    def _extrapolated(self, grid: Grid) -> tuple[Array, Array, Array]:
        """Outputs at the grid's nodes after 0 by Richardson extrapolation, their estimated errors, those allowed.

        Errors are relative. Allowed is the accuracy, or the rounding of an output that is a small difference of large
        quantities.
        """
        from .ngspice import session

        at_nodes = self._drive.value(grid.nodes)
        columns: list[Array] = []  # Neville's scheme: columns[j] has been extrapolated j times
        with session().loaded(self._text, float(grid.nodes[-1]), self._names, linear=self._linear) as run:
            for parts in range(1, _MOST_RUNS + 1):
                points = grid.subdivided(parts)
                # straight between nodes, also within a jump's step; a sine is itself at every point
                sine = self._drive.angular_frequency()
                voltages = self._drive.value(points) if sine else np.interp(points, grid.nodes, at_nodes)
                raw = run(points, voltages)[:, parts - 1 :: parts]
                previous, columns = columns, [self._outputs(raw)]
                for j, older in enumerate(previous, 1):
                    ratio = (parts / (parts - j)) ** 2
                    columns.append(columns[-1] + (columns[-1] - older) / (ratio - 1))
                if parts > 1:
                    errors = self._errors(columns[-1] - columns[-2], columns[-1])
                    if (errors <= self._accuracy).all():
                        return columns[-1], errors, np.full_like(errors, self._accuracy)
        terms = self._outputs(np.abs(raw), absolute=True)
        return columns[-1], errors, np.maximum(self._accuracy, _ROUNDING * _relative(terms, columns[-1]))

    def _outputs(self, raw: Array, *, absolute: bool = False) -> Array:
        """Outputs (n, outputs, points) as sums of ngspice's vectors; ``absolute``: of the terms' sizes."""
        row = {name: k for k, name in enumerate(self._names)}
        result = np.zeros((len(self._nets), len(self._judged), raw.shape[1]))
        for j, output in enumerate(self._nets[0].outputs):
            for term, (quantity, _) in enumerate(output.terms):
                coefficients = np.array([netlist.outputs[j].terms[term][1] for netlist in self._nets])
                if coefficients.any():
                    rows = [row[of_copy[quantity]] for of_copy in self._vectors]
                    result[:, j] += (np.abs(coefficients) if absolute else coefficients)[:, None] * raw[rows]
        return result

    def _errors(self, difference: Array, values: Array) -> Array:
        """Largest difference over largest value (n, outputs); 0 for what is not judged."""
        return np.where(self._judged, _relative(difference, values), 0.0)


def _relative(difference: Array, values: Array) -> Array:
    """Largest difference over largest value, per waveform (last axis reduced); 0 where the waveform is zero."""
    error, scale = np.abs(difference).max(axis=-1), np.abs(values).max(axis=-1)
    return np.asarray(np.divide(error, scale, out=np.zeros_like(error), where=scale > 0))


def _sample(grid: Grid, at_nodes: Array) -> tuple[Array, Array]:
    """Values at the samples, and the relative error (n, outputs) of interpolation where samples are not nodes."""
    result = np.empty((*at_nodes.shape[:2], len(grid.samples)))
    doubt = np.zeros(at_nodes.shape[:2])
    on_node = grid.index > 0
    result[..., on_node] = at_nodes[..., grid.index[on_node] - 1]
    between = np.flatnonzero(~on_node)
    if not len(between):
        return result, doubt
    piece = grid.piece[between]
    for k in np.unique(piece):
        first, last = grid.segments[k]
        first = max(first, 1)  # the point t = 0 is the state before the drive; its right limit is one step on
        where = between[piece == k]
        nodes, values = grid.nodes[first : last + 1], at_nodes[..., first - 1 : last]
        fine, coarse = (values @ _lagrange(nodes, grid.samples[where], width).T for width in _INTERPOLATION_NODES)
        result[..., where] = fine
        doubt = np.maximum(doubt, _CAUTION * _relative(fine - coarse, at_nodes))
    return result, doubt


def _lagrange(nodes: Array, at: Array, width: int) -> Array:
    """Weights (samples, nodes) of local polynomial interpolation through the ``width`` nearest nodes of a smooth piece.

    Local, because a spline of this degree rings on grids whose steps grow as fast as these.
    """
    width = min(width, len(nodes))
    left = np.clip(np.searchsorted(nodes, at) - width // 2, 0, len(nodes) - width)
    window = left[:, None] + np.arange(width)
    x = nodes[window]
    difference = x[:, :, None] - x[:, None, :]
    distance = np.broadcast_to(at[:, None, None] - x[:, None, :], difference.shape).copy()
    diagonal = np.arange(width)
    difference[:, diagonal, diagonal] = distance[:, diagonal, diagonal] = 1.0
    weights = np.zeros((len(at), len(nodes)))
    np.put_along_axis(weights, window, np.prod(distance / difference, axis=2), axis=1)
    return weights
