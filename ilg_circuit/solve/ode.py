"""The electrical port as ordinary differential equations, integrated by scipy: an answer that shares no circuit.

With nonlinear elements there is no exact engine; these equations are written from the laws themselves, not from the
netlist, so that they check it. They neglect the voltage that the motion reflects, 1e-10 of the drive.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from ..arrays import Array
from ..drive import Drive, by_current, voltage_limit
from ..errors import SolveError
from ..strip.port import Port

#: Tight, because between its steps the method interpolates by a cubic only.
_RTOL, _ATOL = 1e-12, 1e-15


def port_response(port: Port, drive: Drive, times: Array) -> tuple[Array, Array]:
    """Return the current [A] into the port and the charge [C] on its ion path at ``times`` [s], from rest at 0.

    Of a drive by current, with or without a limit of its source, the voltage [V] in place of the current. States are
    the charges: q_k' = (v_p - v_k(q_k))/R_k, where v_p solves (u - v_p)/Re = i_electron(v_p) + sum of q_k'.
    Raises SolveError when the integration fails.
    """
    from scipy.integrate import solve_ivp

    system = _System(port, drive)
    end = float(times[-1])
    bounds = np.unique(np.concatenate([[0.0], drive.breakpoints(end), [end]]))
    charges = np.zeros(system.states)
    current, charge = np.zeros(len(times)), np.zeros(len(times))
    for left, right in pairwise(bounds):
        # within a piece the drive is smooth; at its ends the limit from within counts
        inside = (times >= left) & ((times < right) | (right == end))
        found = solve_ivp(
            system.rates,
            (left, right),
            charges,
            method="Radau",
            rtol=_RTOL,
            atol=_ATOL,
            t_eval=np.union1d(times[inside], [right]),
            args=(_within(drive, left, right),),
        )
        if not found.success:
            raise SolveError(f"the port's equations could not be integrated: {found.message}")
        at = np.searchsorted(found.t, times[inside])
        states = found.y[:, at]
        current[inside] = [
            system.answer(float(drive.value(t)), q) for t, q in zip(times[inside], states.T, strict=True)
        ]
        charge[inside] = system.charge(states)
        charges = found.y[:, -1]
    if end == 0:
        current[:] = system.answer(float(drive.value(0.0)), charges)
    return current, charge


def _within(drive: Drive, left: float, right: float) -> Callable[[float], float]:
    """Return the drive's voltage in a piece in which it is smooth, at both ends the limit from within."""
    if drive.angular_frequency():
        return lambda t: float(drive.value(t))
    start, middle = drive.value([left, (left + right) / 2])
    return lambda t: float(start + (middle - start) * (t - left) / ((right - left) / 2))


class _System:
    """The port's right-hand side. A ladder's sections are states too; the charge of its capacitor is the port's."""

    def __init__(self, port: Port, drive: Drive) -> None:
        self._port = port
        self._by_current, self._limit = by_current(drive), voltage_limit(drive)
        pairs = port.branches
        if port.ladder is not None:
            pairs = (*port.ladder.sections, (np.inf, port.ladder.capacitance))
            self._series = port.series_resistance + port.ladder.resistance
        self._r, self._c = np.array(pairs).T
        self.states = len(pairs)

    def charge(self, q: Array) -> Array:
        return np.asarray(q[-1] if self._port.ladder is not None else q.sum(axis=0))

    def rates(self, t: float, q: Array, source: Callable[[float], float]) -> Array:
        return self._ions(self._across(source(t), q)[0], q)[1]

    def answer(self, source: float, q: Array) -> float:
        """Return the current of a voltage, or the voltage of a current."""
        inner, terminal = self._across(source, q)
        if self._by_current:
            return terminal
        return float(self._port.electron_current(inner)) + self._ions(inner, q)[0]

    def _across(self, source: float, q: Array) -> tuple[float, float]:
        """Return the voltages behind Re and at the terminals under a ``source`` of voltage or current."""
        if not self._by_current:
            return self._inner(source, q), source
        at_zero, at_one = (self._ions(across, q)[0] for across in (0.0, 1.0))
        conductance = at_one - at_zero
        inner = self._port.voltage_behind(conductance, (source - at_zero) / conductance)
        terminal = inner + self._port.electrode_resistance * source
        if self._limit is not None and abs(terminal) > self._limit:
            terminal = math.copysign(self._limit, terminal)
            inner = self._inner(terminal, q)
        return inner, terminal

    def _ions(self, inner: float, q: Array) -> tuple[float, Array]:
        """Return the current into the ion path with ``inner`` [V] across it, and the rates of the charges."""
        law = self._port.charge_law
        voltages = q / self._c if law is None else law.voltage(q / self._c)
        if self._port.ladder is not None:
            current = (inner - voltages.sum()) / self._series
            return float(current), np.asarray(current - voltages / self._r)
        currents = (inner - voltages) / self._r
        return float(currents.sum()), np.asarray(currents)

    def _inner(self, terminal: float, q: Array) -> float:
        """Return the voltage behind Re. All but the electron path is linear in it."""
        if not self._port.electrode_resistance:
            return terminal
        at_zero, at_one = (self._ions(across, q)[0] for across in (0.0, 1.0))
        conductance = 1 / self._port.electrode_resistance + at_one - at_zero
        driven = terminal / self._port.electrode_resistance - at_zero
        return self._port.voltage_behind(conductance, driven / conductance)
