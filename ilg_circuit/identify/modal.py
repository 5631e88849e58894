"""The current into a linear port as a sum of decaying modes, whose answer to a measured drive is a closed form.

Many parameter sets at once, and far cheaper than an engine: for the thousands of answers that a search of many starts,
a profile likelihood or a Markov chain wants.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..arrays import Array
from ..circuit.strip import port_netlist
from ..drive import PiecewiseLinear
from ..solve.state_space import state_space
from ..strip.port import Port

#: values (m, parameters) -> the ports that they make
Ports = Callable[[Array], list[Port]]

#: Grid points advanced together: memory stays small for long records.
_BLOCK = 2000


def modal_currents(ports: Sequence[Port], drive: PiecewiseLinear, t: Array) -> Array:
    """Return currents [A] (ports, samples) into linear ``ports`` of one model at ``t`` >= 0 [s], each a sum of modes.

    Between samples and breakpoints the drive is a straight line, so that one multiplication advances a mode exactly.
    """
    system = state_space([port_netlist(port) for port in ports])
    row = system.output_names.index("current")
    poles, shapes = np.linalg.eig(system.a)
    excited = np.linalg.solve(shapes, system.b[:, :, :1])[:, :, 0]
    # a network of resistors and capacitors has real poles: what is imaginary is rounding
    amounts = np.real(np.einsum("ns,nsk->nk", system.c[:, row], shapes) * excited)
    rates = -np.real(poles)
    grid = np.union1d(np.concatenate([[0.0], drive.breakpoints(float(t[-1]))]), t)
    widths, first = np.diff(grid), drive.value(grid[:-1])
    slopes = 2 * (drive.value(grid[:-1] + widths / 2) - first) / widths
    moved = np.zeros((len(grid), len(rates)))
    state = np.zeros_like(rates)
    for start in range(0, len(widths), _BLOCK):
        part = slice(start, start + _BLOCK)
        width = widths[part, None, None]
        kept = np.exp(-rates * width)
        held = (1 - kept) / rates
        gained = first[part, None, None] * held + slopes[part, None, None] * (width - held) / rates
        states = np.empty_like(kept)
        for k in range(len(kept)):
            states[k] = state = kept[k] * state + gained[k]
        moved[start + 1 : start + 1 + len(kept)] = np.einsum("tns,ns->tn", states, amounts)
    return np.asarray(system.d[:, row, :1] * drive.value(t) + moved[np.searchsorted(grid, t)].T)
