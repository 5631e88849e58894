"""The state space of linear electrical ports, and that of d(s) alone, written down at once for many of them.

It is what `state_space` makes of their netlists, without making these: a fit needs it some thousand times.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..circuit.strip import port_netlist
from ..strip.coupling import Coupling
from ..strip.port import Port
from .state_space import StateSpace, state_space


def port_system(ports: Sequence[Port]) -> StateSpace:
    """Return the state space of linear ``ports`` of one model, whose only output is the current [A].

    The states are voltages [V] of capacitors: of the branches, or of a ladder's sections and the capacitor at its end.
    With the conductance g of the ion path to v - (the states that count), v the voltage behind Re:

        i = (u - v)/Re = v/Rdc + i_ions,     i_ions = sum of g_k (v - x_k)   or   g (v - sum of x_k)
    """
    if ports[0].inductance:
        return state_space([port_netlist(port) for port in ports])
    if ports[0].ladder is None:
        resistances, capacities = np.array([port.branches for port in ports]).transpose(2, 0, 1)
        leaks = np.zeros_like(resistances)
        # i_ions = sum of g_k v - g_k x_k, x_k' = g_k (v - x_k)/C_k
        own = 1 / resistances
        total, felt = own.sum(axis=1), own
        fed, coupled = own / capacities, -own[:, :, None] * np.eye(own.shape[1]) / capacities[:, :, None]
    else:
        ladders = [port.ladder for port in ports]
        sections = np.array([[*ladder.sections, (np.inf, ladder.capacitance)] for ladder in ladders if ladder])
        leaks, capacities = 1 / sections[:, :, 0], sections[:, :, 1]
        total = np.array([1 / (p.series_resistance + p.ladder.resistance) for p in ports if p.ladder])
        # x_k' = (g (v - sum of x) - x_k/R_k)/C_k
        felt = np.repeat(total[:, None], capacities.shape[1], axis=1)
        fed, coupled = felt / capacities, -felt[:, :, None] * np.ones(capacities.shape[1]) / capacities[:, :, None]
    a = coupled - leaks[:, :, None] * np.eye(capacities.shape[1]) / capacities[:, :, None]
    electrons = np.array([1 / port.dc_resistance for port in ports])
    electrodes = np.array([port.electrode_resistance for port in ports])
    # v = share u + through x: all of u where there is no Re
    share = 1 / (1 + electrodes * (electrons + total))
    through = (electrodes * share)[:, None] * felt
    a = a + fed[:, :, None] * through[:, None, :]
    b = fed * share[:, None]
    d = share * (electrons + total)
    c = (electrons + total)[:, None] * through - felt
    zero = np.zeros
    return StateSpace(
        a,
        np.stack([b, zero(b.shape)], axis=2),
        c[:, None, :],
        np.stack([d, zero(d.shape)], axis=1)[:, None, :],
        ("current",),
    )


def coupling_system(couplings: Sequence[Coupling], ratio: float) -> StateSpace:
    """Return the state space of ``ratio`` d(s), whose only output is the free displacement [m] of a static beam.

    For strips without resistance before the ion path, whose drive is the voltage that d(s) is of. The states are the
    voltage x [V] of the filter's capacitor and its rate: x'' = wn^2 (u - x) - 2 zeta wn x', y = ratio d0 (x + x'/Zd).
    """
    zero, zeta, wn, static = np.array([(k.zero, k.damping_ratio, k.natural_frequency, k.static) for k in couplings]).T
    count = len(couplings)
    a, b, c = np.zeros((count, 2, 2)), np.zeros((count, 2, 2)), np.zeros((count, 1, 2))
    a[:, 0, 1], a[:, 1, 0], a[:, 1, 1] = 1.0, -(wn**2), -2 * zeta * wn
    b[:, 1, 0] = wn**2
    c[:, 0] = ratio * np.stack([static, static / zero], axis=1)
    return StateSpace(a, b, c, np.zeros((count, 1, 2)), ("displacement",))
