"""Solves linear netlists exactly: the state space by modes or matrix exponentials, without time step and tolerance.

Between breakpoints a drive is a straight line or a sine. The answer of a mode to either is a closed form; where modes
cancel, state and input together obey a homogeneous linear equation, whose exponential is exact. It checks ngspice and
makes huge linear sweeps cheap.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, one_thread
from ..drive import ON_EDGE, Drive, Drives, each
from ..errors import SolveError
from .modes import CANCELLING, decomposed, modes_of
from .panels import FRACTIONS, Panels
from .propagators import Propagators
from .state_space import StateSpace
from .waves import (
    BLOCK,
    drive_at,
    drive_lines,
    interval_grid,
    jumps_until,
    values_at,
    waves_under_lines,
    waves_under_sine,
)

#: Relative contribution to an output below which a mode is negligible.
_FELT = 1e-13
#: The same as `CANCELLING` for derivatives.
_SLOPES_CANCELLING = 1e4
#: The same for panels, which are good to seven digits.
_CANCELLING_ON_PANELS = 1e7
#: Largest number of values of modes that are held at once.
_MOST_WAVES = 4_000_000


def exact_outputs(system: StateSpace, drive: Drive, times: Array, *, modes: bool = True) -> Array:
    """Return the outputs at ``times`` [s] (ascending, >= 0), from rest at t = 0; shape (n, outputs, times).

    A sample on a jump of the drive is the right limit. By modes, which cost less than exponentials and keep the digits
    of slow states beside fast ones, unless they cancel or ``modes`` is False. Raises SolveError when the result is not
    finite.
    """
    if modes and (found := _by_modes(system, drive, times)) is not None:
        return found
    grid = interval_grid(drive, times)
    inputs = np.append(_inputs(drive, grid[:-1], np.diff(grid)), _inputs(drive, grid[-1:]), axis=1)
    widths = _shared_widths(grid, interval_grid(drive, times[-1:]))
    outputs = _outputs(system, _frequencies(drive), inputs, widths, np.ones(1))
    return _finite(np.concatenate(outputs, axis=2)[..., 0])[:, :, np.searchsorted(grid, times)]


def exact_on_panels(system: StateSpace, drive: Drive, panels: Panels) -> Array:
    """Return the outputs at the points of ``panels``, from rest at t = 0; shape (n, outputs, panels, points).

    By modes, as `exact_outputs`. Raises SolveError when the result is not finite.
    """
    if (found := _by_modes(system, drive, panels.points.ravel(), _CANCELLING_ON_PANELS)) is not None:
        return found.reshape(*found.shape[:2], *panels.points.shape)
    inputs = _inputs(drive, panels.starts, panels.widths)
    fractions = np.append(FRACTIONS[1:], 1.0)
    outputs = _outputs(system, _frequencies(drive), inputs, panels.widths, fractions)
    return _finite(np.concatenate(outputs, axis=2))


def _by_modes(system: StateSpace, drive: Drive, times: Array, cancelling: float = CANCELLING) -> Array | None:
    """Return all outputs (n, outputs, times), from rest at t = 0, as sums of modes; None where modes cancel.

    That is where their terms are more than ``cancelling`` times the output. And None for circuits of several sources,
    or with constant ones.
    """
    if isinstance(drive, Drives) or system.b.shape[2] != 2 or system.b[..., 1].any() or system.d[..., 1].any():
        return None
    modes = modes_of(system)
    omega = drive.angular_frequency()
    if modes is None or (omega and not (np.abs(modes.poles**2 + omega**2) * CANCELLING > omega**2).all()):
        return None
    under = waves_under_sine if omega else waves_under_lines
    result = system.d[..., :1] * drive.value(times)
    terms = np.zeros(result.shape[:2])
    for poles, amounts in _parted(modes.poles, modes.shown * modes.excited[:, None, :, 0]):
        largest = np.zeros(poles.shape)
        parts = max(min(-(-poles.size * BLOCK // _MOST_WAVES), len(poles)), 1)
        for some in np.array_split(np.arange(len(poles)), parts):
            for part, waves in under(poles[some], drive, times):
                result[some, :, part] += np.real(amounts[some] @ waves.transpose(1, 2, 0))
                largest[some] = np.maximum(largest[some], np.abs(waves).max(axis=0, initial=0.0))
        terms += (np.abs(amounts) @ largest[..., None])[..., 0]
    tell_apart = (terms <= cancelling * np.abs(result).max(axis=2)).all()
    return result if np.isfinite(terms).all() and tell_apart else None


def _parted(poles: NDArray[Any], amounts: NDArray[Any]) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """Return poles (n, s) and amounts (n, outputs, s) in parts: one of each conjugate pair, and real numbers.

    The amounts of a pair are doubled. All in one part where not all netlists have as many pairs.
    """
    if not np.iscomplexobj(poles) or not poles.size:
        return [(poles, amounts)]
    side = np.sign(poles.imag)
    pairs = (side > 0).sum(axis=1)
    if (pairs != pairs[0]).any() or ((side < 0).sum(axis=1) != pairs).any():
        return [(poles, amounts)]
    order = np.argsort(-side, axis=1, kind="stable")
    poles, amounts = np.take_along_axis(poles, order, 1), np.take_along_axis(amounts, order[:, None], 2)
    above = int(pairs[0])
    alone = slice(above, poles.shape[1] - above)
    parts = [(poles[:, :above], 2 * amounts[..., :above]), (poles[:, alone].real, amounts[..., alone].real)]
    return [part for part in parts if part[0].size]


def modal_output(system: StateSpace, output: str, drive: Drive, times: Array) -> Array:
    """Return one output at ``times`` [s] (ascending, >= 0) as a sum of modes; shape (n, times).

    It applies to systems whose poles have negative real parts, under a piecewise linear drive, and costs a small part
    of `exact_outputs`, which is used instead where modes cancel: if poles are so close that their eigenvectors are
    nearly parallel, as in a critically damped filter.
    """
    row = system.output_names.index(output)
    modes = modes_of(system)
    if modes is None:
        return exact_outputs(system, drive, times)[:, row]
    poles, amounts = modes.poles, modes.shown[:, row] * modes.excited[..., 0]
    with np.errstate(all="ignore"):
        held = amounts / poles  # steady response of each mode to a constant input
        total = np.maximum(np.abs(held.sum(axis=1)), np.abs(system.d[:, row, 0]))
        size = np.abs(held)
        tell_apart = (size.sum(axis=1) < CANCELLING * total).all()
    if not tell_apart:
        return exact_outputs(system, drive, times)[:, row]
    felt = (size > _FELT * total[:, None]).any(axis=0)
    result = np.asarray(system.d[:, row, :1] * values_at(drive, times))
    for own, single in _parted(poles[:, felt], amounts[:, None, felt]):
        for part, waves in waves_under_lines(own, drive, times):
            result[:, part] += np.real(np.einsum("tns,ns->nt", waves, single[:, 0]))
    return result


def modal_slopes(
    system: StateSpace, output: str, drive: Drive, times: Array, step: float
) -> tuple[Array, Array] | None:
    """Return one output (times,) of a netlist and its derivatives (times, p) by p coordinates; None where modes cancel.

    ``system`` are 2 p + 1 netlists: this one, those with each coordinate greater by ``step``, those with each smaller.
    Only their matrices are compared. In the modes x_j of the first, x_j = b_j W_j with W_j' = p_j W_j + u, and
    y = sum of c_j x_j + D u, a change of the matrices, M in modes, changes the output by

        dD u + sum of W_j (c_j db_j + dc_j b_j) + sum of c_j M_jk b_k (W_j - W_k)/(p_j - p_k),  dW_j/dp_j for k = j
    """
    row = system.output_names.index(output)
    found = decomposed(system.of(np.array([0])))
    if found is None:
        return None
    poles, left, shapes, order = (part[0] for part in found)
    count = len(system.a) // 2

    def changes(part: Array) -> Array:
        return np.asarray((part[1 : count + 1] - part[count + 1 :]) / (2 * step))

    b, c, d = left @ system.b[0, order, 0], system.c[0, row, order] @ shapes, float(system.d[0, row, 0])
    of_b, of_c, of_d = changes(system.b)[:, order, 0], changes(system.c)[:, row, order], changes(system.d)[:, row, 0]
    mixed = c[:, None] * (left @ changes(system.a)[:, order][:, :, order] @ shapes) * b  # (p, s, s)
    own = np.diagonal(mixed, axis1=1, axis2=2)
    with np.errstate(all="ignore"):
        apart = poles[:, None] - poles
        np.fill_diagonal(apart, np.inf)
        along = c * (of_b @ left.T) + (of_c @ shapes) * b + ((mixed + mixed.swapaxes(1, 2)) / apart).sum(axis=2)
        amounts = np.concatenate([(c * b)[None], along]) / poles
        total = max(abs(amounts[0].sum()), abs(d))
        size = np.abs(amounts)
        size[1:] += np.abs(own / poles**2)
        tell_apart = (size.sum(axis=1) < _SLOPES_CANCELLING * total).all()
    if not tell_apart:
        return None
    felt = (size > _FELT * total).any(axis=0)
    poles, amounts, own = poles[felt], (amounts * poles)[:, felt], own[:, felt]
    result = np.asarray(np.append(d, of_d)[:, None] * values_at(drive, times))
    for part, waves in waves_under_lines(poles[None], drive, times, slopes=True):
        result[:, part] += np.real(amounts @ waves[:, 0].T)
        result[1:, part] += np.real(own @ waves[:, 1].T)
    return result[0], result[1:].T


def modal_jump_slopes(system: StateSpace, output: str, drive: Drive, times: Array) -> Array | None:
    """Return derivatives (times, j) of one output of a netlist by the times [s] of the onset and of the drive's jumps.

    Between jumps up to the last of ``times`` [s] the drive must be constant. A jump that comes later moves the output
    from there on by that of an impulse. None where eigenvectors are nearly parallel, see `modes_of`.
    """
    modes = modes_of(system)
    if modes is None:
        return None
    row = system.output_names.index(output)
    poles, amounts = modes.poles[0], modes.shown[0, row] * modes.excited[0, :, 0]
    jumps = jumps_until(drive, float(times[-1]))
    rises = np.diff(drive.value(jumps), prepend=drive.rest)
    found = np.zeros((len(times), len(jumps)))
    for j, (at, rise) in enumerate(zip(jumps.tolist(), rises.tolist(), strict=True)):
        after = slice(np.searchsorted(times, at * (1 - ON_EDGE)), None)
        found[after, j] = -rise * np.real(np.exp(np.outer(times[after] - at, poles)) @ amounts)
    return found


def _shared_widths(grid: Array, edges: Array) -> Array:
    """Return the widths of the intervals of ``grid`` [s], between whose ``edges`` [s] the drive is smooth.

    Pieces from edge to edge that are divided equally, apart from rounding of times, get the widths of the first one, so
    that they share exponentials. Widths of each piece start at its edge, so that rounding does not accumulate.
    """
    widths = np.diff(grid)
    rounding = 4 * np.spacing(grid[-1])
    bounds = np.searchsorted(grid, edges).tolist()
    first: dict[tuple[int, str], tuple[int, int]] = {}
    for begin, end in pairwise(bounds):
        a, b = first.setdefault((end - begin, f"{grid[end] - grid[begin]:.9e}"), (begin, end))
        apart = np.abs((grid[begin : end + 1] - grid[begin]) - (grid[a : b + 1] - grid[a])).max(initial=0.0)
        if apart <= rounding:
            widths[begin:end] = widths[a:b]
    return widths


def _frequencies(drive: Drive) -> list[float]:
    """Return the angular frequency [rad/s] of each source's drive, 0 for lines."""
    return [part.angular_frequency() for part in each(drive)]


def _inputs(drive: Drive, starts: Array, widths: Array | None = None) -> Array:
    """Return `drive_lines` of all sources (2 sources, m); without ``widths`` at single times, see `drive_at`."""
    parts = [drive_at(part, starts) if widths is None else drive_lines(part, starts, widths) for part in each(drive)]
    return np.concatenate(parts)


@one_thread()
def _outputs(system: StateSpace, omegas: list[float], inputs: Array, widths: Array, fractions: Array) -> list[Array]:
    """Return the outputs (n, outputs, intervals, points) of blocks of intervals that follow one another.

    ``inputs`` (2 sources, m) at the starts of intervals of ``widths`` (m,), or of one interval more, which has no
    width: the end. ``omegas`` [rad/s] of the sources. The points of an interval are its start and ``fractions`` of its
    width, the last of which is 1 and begins the next one.
    """
    matrix, output = augmented(system, omegas)
    states, size = system.a.shape[1], matrix.shape[1]
    propagators = Propagators(matrix, widths, fractions)
    x = np.zeros((len(matrix), size, 1))
    x[:, -1] = 1.0
    count = inputs.shape[1]
    blocks = []
    for first in range(0, count, BLOCK):
        block = range(first, min(first + BLOCK, count))
        at_points = np.empty((len(matrix), size, len(block), len(fractions)))
        for k in block:
            x[:, states:-1, 0] = inputs[:, k]
            at_points[:, :, k - first, 0] = x[..., 0]
            if k < len(widths):
                later = propagators.after(k, x)
                at_points[:, :, k - first, 1:] = later[:, :-1].transpose(0, 2, 1)
                x = later[:, -1, :, None].copy()
        flat = output @ at_points.reshape(len(matrix), size, -1)
        blocks.append(flat.reshape(len(matrix), output.shape[1], len(block), len(fractions)))
    return blocks


def _finite(result: Array) -> Array:
    if not np.isfinite(result).all():
        raise SolveError("the exact engine's result is not finite: a value of the actuator is implausible")
    return result


def augmented(system: StateSpace, omegas: list[float]) -> tuple[Array, Array]:
    """Return the state, each drive and its companion, and the constant 1 as one autonomous system, and its outputs."""
    n, s, _ = system.a.shape
    size = s + 2 * len(omegas) + 1
    matrix = np.zeros((n, size, size))
    output = np.zeros((n, system.c.shape[1], size))
    matrix[:, :s, :s], matrix[:, :s, -1] = system.a, system.b[:, :, -1]
    output[:, :, :s], output[:, :, -1] = system.c, system.d[:, :, -1]
    for k, omega in enumerate(omegas):
        at = s + 2 * k
        matrix[:, :s, at], output[:, :, at] = system.b[:, :, k], system.d[:, :, k]
        matrix[:, at, at + 1] = omega or 1.0
        if omega:
            matrix[:, at + 1, at] = -omega
    return matrix, output
