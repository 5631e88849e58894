"""Predicts what ports answer, and the derivatives by their parameters without an engine, for the predictions of a fit.

Linear ports are sums of modes (see `modal`); nonlinear R-C branches are solved by collocation. A nonlinear path of the
electrons straight across the voltage takes a current of its own, whatever the ions do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Array
from ..circuit.netlist import Netlist
from ..circuit.strip import electron_netlist, port_netlist
from ..drive import PiecewiseLinear
from ..solve.collocation import Nearby, answer_slopes, answers, jump_slopes
from ..solve.transient import transient
from ..strip.port import Port
from .jumps import WithJumps
from .modal import (
    STEP,
    Ports,
    differences,
    modal_current_slopes,
    modal_currents,
    modal_jump_currents,
    modal_jump_voltages,
    modal_voltage_slopes,
    modal_voltages,
    perturbed,
    with_slopes,
)
from .port_model import PortModel

#: Error of an engine's transient in a fit, relative to the largest current.
ACCURACY = 1e-6


def closed(model: PortModel, *, by_current: bool = False) -> bool:
    """Return True if ports of a model are answered without an engine."""
    kind = model.kind
    return kind.linear or kind.ions.grows or (not by_current and model.held == 0)


def at_rest(ports: Sequence[Port], voltage: float) -> Array:
    """Return the steady currents [A] (ports,) under ``voltage`` [V]."""
    return np.array([float(port.electron_current(port.inner_voltage(voltage))) if voltage else 0.0 for port in ports])


@dataclass(frozen=True)
class Response:
    """What ports of one model answer to a ``drive``: the current under a voltage, or ``by_current`` the voltage."""

    drive: PiecewiseLinear
    by_current: bool = False

    def at_rest(self, ports: Sequence[Port]) -> Array:
        """Return what ``ports`` do before the onset (ports,)."""
        if not self.by_current:
            return at_rest(ports, self.drive.rest)
        if not ports[0].linear:
            return np.zeros(len(ports))
        return np.array([self.drive.rest * port.steady_resistance for port in ports])

    def answers(self, ports: Sequence[Port], t: Array, nearby: Nearby | None = None) -> Array:
        """Return the answers (ports, samples) at ``t`` >= 0 [s], see `currents_of`."""
        return (voltages_of if self.by_current else currents_of)(ports, self.drive, t, nearby)

    def slopes(self, ports: Sequence[Port], t: Array, nearby: Nearby) -> tuple[Array, Array] | None:
        """Return the answer at ``t`` >= 0 [s] and its derivatives, see `current_slopes`."""
        return (voltage_slopes if self.by_current else current_slopes)(ports, self.drive, t, nearby)

    def by_jumps(self, port: Port, t: Array, nearby: Nearby) -> Array | None:
        """Return derivatives [1/s] (samples, j) of a port's answer at ``t`` >= 0 by the times of onset and later jumps.

        None where modes cancel, and of drives that are not constant between jumps.
        """
        if np.diff(self.drive.values)[np.diff(self.drive.times) > 0].any():
            return None
        apart = not self.by_current and _electrons_apart(port)  # the electrons' path has no memory
        if port.linear or apart:
            return (modal_jump_voltages if self.by_current else modal_jump_currents)(_ohmic(port), self.drive, t)
        return jump_slopes(port, self.drive, t, by_current=self.by_current, nearby=nearby)

    def prediction(self, ports: Ports, t: Array) -> WithJumps:
        """Return the prediction at ``t`` [s] since the onset of what ``ports`` makes of sets of parameters."""
        after, nearby = t >= 0, Nearby()

        def predict(values: Array) -> Array:
            made = ports(values)
            waveforms = np.repeat(self.at_rest(made)[:, None], len(t), axis=1)
            waveforms[:, after] = self.answers(made, t[after], nearby)
            return waveforms

        def slopes(values: Array) -> tuple[Array, Array] | None:
            made = ports(perturbed(values))
            found = self.slopes(made, np.maximum(t, 0.0), nearby)
            if found is None:
                return None
            rest = self.at_rest(made)
            found[0][~after], found[1][~after] = rest[0], differences(rest)
            return found

        def by_jumps(values: Array) -> Array | None:
            found = self.by_jumps(ports(values[None])[0], np.maximum(t, 0.0), nearby)
            if found is not None:
                found[~after] = 0.0
            return found

        known = with_slopes(predict, slopes)
        return WithJumps(known.predict, known.slopes, by_jumps)


def engine_currents(
    ports: Sequence[Port], drive: PiecewiseLinear, t: Array, engine: str, accuracy: float = ACCURACY
) -> Array:
    """Return currents [A] (ports, samples) into ``ports`` of one model at ``t`` [s], steady before the onset at 0.

    ``accuracy`` is their error by ngspice, relative to the largest. A nonlinear path of the electrons straight across
    the voltage is solved by itself: what is left is linear, and needs no iterations.
    """

    def solved(netlists: list[Netlist]) -> Array:
        how: dict[str, Any] = {"engine": engine, "accuracy": accuracy, "acceptable": 10 * accuracy}
        return transient(netlists, drive, t[after], **how).values[:, 0]

    after = t >= 0
    result = np.repeat(at_rest(ports, drive.rest)[:, None], len(t), axis=1)
    if engine == "ngspice" and not ports[0].linear and _electrons_apart(ports[0]):
        ohmic = [_ohmic(port) for port in ports]
        result[:, after] = solved([port_netlist(port, rest=drive.rest) for port in ohmic])
        result[:, after] += solved([electron_netlist(port, rest=drive.rest) for port in ports])
        result[:, after] -= np.array([drive.value(t[after]) / port.dc_resistance for port in ports])
    else:
        result[:, after] = solved([port_netlist(port, rest=drive.rest) for port in ports])
    return result


def currents_of(ports: Sequence[Port], drive: PiecewiseLinear, t: Array, nearby: Nearby | None = None) -> Array:
    """Return the currents [A] (ports, samples) into ``ports`` of one model at ``t`` >= 0 [s].

    A row is not finite where the port cannot be solved; ports of charge laws are solved beside what is ``nearby``.
    """
    first = ports[0]
    if first.linear:
        return modal_currents(ports, drive, t)
    if _electrons_apart(first):
        return modal_currents([_ohmic(port) for port in ports], drive, t) + _beyond_ohm(ports, drive.value(t))
    return answers(ports, drive, t, nearby=nearby)


def current_slopes(
    ports: Sequence[Port], drive: PiecewiseLinear, t: Array, nearby: Nearby | None = None
) -> tuple[Array, Array] | None:
    """Return the current [A] (samples,) of a port and its derivatives (samples, p) by logarithms of its parameters.

    ``ports`` are those of `perturbed` values. None where modes cancel; raises SolveError where it cannot be solved.
    """
    first = ports[0]
    if first.linear:
        return modal_current_slopes(ports, drive, t)
    if not _electrons_apart(first):
        return answer_slopes(ports, drive, t, STEP, nearby=nearby)
    found = modal_current_slopes([_ohmic(port) for port in ports], drive, t)
    if found is None:
        return None
    more = _beyond_ohm(ports, drive.value(t))
    return found[0] + more[0], found[1] + differences(more)


def voltages_of(ports: Sequence[Port], drive: PiecewiseLinear, t: Array, nearby: Nearby | None = None) -> Array:
    """Return the voltages [V] (ports, samples) of ``ports`` under a current, as `currents_of`."""
    if ports[0].linear:
        return modal_voltages(ports, drive, t)
    return answers(ports, drive, t, by_current=True, nearby=nearby)


def voltage_slopes(
    ports: Sequence[Port], drive: PiecewiseLinear, t: Array, nearby: Nearby | None = None
) -> tuple[Array, Array] | None:
    """Return the voltage [V] of a port under a current and its derivatives, as `current_slopes`."""
    if ports[0].linear:
        return modal_voltage_slopes(ports, drive, t)
    return answer_slopes(ports, drive, t, STEP, by_current=True, nearby=nearby)


def _electrons_apart(port: Port) -> bool:
    """Return True if only the electron path is nonlinear, and lies straight across the voltage."""
    return port.charge_law is None and not port.electrode_resistance


def _ohmic(port: Port) -> Port:
    return replace(port, emission_voltage=None)


def _beyond_ohm(ports: Sequence[Port], voltage: Array) -> Array:
    """Return what the electron paths take beyond an ohmic one [A] (ports, samples) under ``voltage`` (samples,)."""
    return np.array([port.electron_current(voltage) - voltage / port.dc_resistance for port in ports])
