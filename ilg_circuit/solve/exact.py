"""Exact transient of linear netlists: the state space solved by matrix exponentials, no time step, no tolerance.

Between breakpoints a drive is a straight line or a sine, so state and input together obey a homogeneous linear
equation, whose exponential is exact. It checks ngspice and makes huge linear sweeps cheap.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..drive import Drive
from ..errors import SolveError
from .panels import FRACTIONS, Panels
from .state_space import StateSpace

Array = NDArray[np.float64]


def exact_outputs(system: StateSpace, drive: Drive, times: Array) -> Array:
    """Outputs at ``times`` [s] (ascending, >= 0), from rest at t = 0; shape (n, outputs, times).

    A sample on a jump of the drive is the right limit. Raises SolveError when the result is not finite.
    """
    end = float(times[-1]) if len(times) else 0.0
    omega = drive.angular_frequency()
    # one grid of breakpoints and samples; each interval is one multiplication by an exponential
    grid = np.union1d(np.concatenate([[0.0], drive.breakpoints(end)]), times)
    start = drive.value(grid[:-1])
    if omega:
        companions = np.array(drive_phase(drive, grid[:-1]))
    else:
        # the left limit at the interval's end: halfway plus half of the rise, exact on a line
        middle = drive.value((grid[:-1] + grid[1:]) / 2)
        companions = 2 * (middle - start) / np.diff(grid)
    augmented, output = _augment(system, omega)
    states = system.a.shape[1]
    # widths that differ by rounding only share one exponential
    widths, steps = np.unique(_rounded(np.diff(grid)), return_inverse=True)
    result = np.empty((len(system.a), output.shape[1], len(grid)))
    x = np.zeros((len(system.a), states + 3))
    x[:, states + 2] = 1.0
    exponentials = _Exponentials(augmented, widths)
    for k in range(len(grid)):
        if k < len(grid) - 1:
            x[:, states], x[:, states + 1] = start[k], companions[k]
        elif omega:
            x[:, states], x[:, states + 1] = drive.value(grid[k]), drive_phase(drive, grid[k])
        else:
            x[:, states], x[:, states + 1] = drive.value(grid[k]), 0.0
        result[:, :, k] = np.einsum("nos,ns->no", output, x)
        if k < len(grid) - 1:
            x = np.einsum("nst,nt->ns", exponentials[int(steps[k])], x)
    if not np.isfinite(result).all():
        raise SolveError("the exact engine's result is not finite: a value of the actuator is out of all proportion")
    return result[:, :, np.searchsorted(grid, times)]


def exact_on_panels(system: StateSpace, drive: Drive, panels: Panels) -> Array:
    """Outputs at the points of ``panels``, from rest at t = 0; shape (n, outputs, panels, points).

    The propagators of a width twice another one are the squares of those, so a run takes few exponentials. Raises
    SolveError when the result is not finite.
    """
    omega = drive.angular_frequency()
    augmented, output = _augment(system, omega)
    states = system.a.shape[1]
    start = drive.value(panels.starts)
    if omega:
        companions = drive_phase(drive, panels.starts)
    else:
        middle = drive.value(panels.starts + panels.widths / 2)
        companions = 2 * (middle - start) / panels.widths
    propagators = _Propagators(augmented, panels)
    x = np.zeros((len(system.a), states + 3, 1))
    x[:, states + 2] = 1.0
    at_points = np.empty((len(system.a), states + 3, *panels.points.shape))
    for k in range(len(panels.starts)):
        x[:, states], x[:, states + 1] = start[k], companions[k]
        later = (propagators.of(k) @ x[:, None])[..., 0]  # (n, points, states): those after the first, and the end
        at_points[:, :, k, 0] = x[..., 0]
        at_points[:, :, k, 1:] = later[:, :-1].transpose(0, 2, 1)
        x = later[:, -1, :, None].copy()
    result = (output @ at_points.reshape(len(at_points), states + 3, -1)).reshape(
        len(at_points), output.shape[1], *panels.points.shape
    )
    if not np.isfinite(result).all():
        raise SolveError("the exact engine's result is not finite: a value of the actuator is out of all proportion")
    return np.asarray(result)


def drive_phase(drive: Drive, t: Array | float) -> Array:
    """The quarter-period companion of a sine: with it (u, companion) rotates at the drive's frequency."""
    quarter = np.pi / 2 / drive.angular_frequency()
    return drive.value(np.asarray(t) + quarter)


def _rounded(widths: Array) -> Array:
    """Widths to 12 significant digits."""
    magnitude = 10.0 ** (11 - np.floor(np.log10(widths)))
    return np.asarray(np.round(widths * magnitude) / magnitude)


def _augment(system: StateSpace, omega: float) -> tuple[Array, Array]:
    """State, drive, its companion (slope, or quadrature of a sine) and the constant 1 as one autonomous system."""
    n, s, _ = system.a.shape
    matrix = np.zeros((n, s + 3, s + 3))
    matrix[:, :s, :s] = system.a
    matrix[:, :s, s] = system.b[:, :, 0]
    matrix[:, :s, s + 2] = system.b[:, :, 1]
    matrix[:, s, s + 1] = omega or 1.0
    if omega:
        matrix[:, s + 1, s] = -omega
    output = np.zeros((n, system.c.shape[1], s + 3))
    output[:, :, :s], output[:, :, s], output[:, :, s + 2] = system.c, system.d[:, :, 0], system.d[:, :, 1]
    return matrix, output


class _Propagators:
    """exp(M f w) for a panel's width w, f being where its points are (but for its start) and, last, its end."""

    def __init__(self, matrix: Array, panels: Panels) -> None:
        self._matrix, self._widths = matrix, panels.widths
        # rounded as a key only: periods of one length differ in their last digits
        self._keys = [float(f"{w:.9e}") for w in panels.widths.tolist()]
        self._last = {key: k for k, key in enumerate(self._keys)}
        self._made: dict[float, Array] = {}

    def of(self, panel: int) -> Array:
        """(n, points, states, states); those of widths that will not come again are forgotten."""
        key, width = self._keys[panel], float(self._widths[panel])
        if key not in self._made:
            half = self._made.get(float(f"{width / 2:.9e}"))
            self._made[key] = half @ half if half is not None else self._exponential(width)
        for old in [k for k in self._made if self._last.get(k, -1) < panel and k != key]:
            del self._made[old]
        return self._made[key]

    def _exponential(self, width: float) -> Array:
        from scipy.linalg import expm

        fractions = np.append(FRACTIONS[1:], 1.0)
        return np.asarray(expm(self._matrix[:, None] * (width * fractions)[:, None, None]))


class _Exponentials:
    """exp(M h) for the interval widths h, made when first asked for."""

    def __init__(self, matrix: Array, widths: Array) -> None:
        self._matrix, self._widths = matrix, widths
        self._made: dict[int, Array] = {}

    def __getitem__(self, index: int) -> Array:
        if index not in self._made:
            from scipy.linalg import expm

            if len(self._made) > 256:  # an irregular grid: keep memory bounded
                self._made.clear()
            self._made[index] = np.asarray(expm(self._matrix * self._widths[index]))
        return self._made[index]
