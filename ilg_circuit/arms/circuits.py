"""The circuits of an arm's strips in one ngspice transient, driven from outside or by the neurons themselves.

With the neurons the whole chain of CPG §6 is one netlist: `ilg_circuit.oscillators.netlist`'s neurons, for each unit a
behavioural source u = Vmax max(-1, min(1, out/A_ref)), for each segment a copy of its strip on the source of its unit.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..circuit.netlist import Netlist, copies
from ..circuit.strip import strip_netlist
from ..errors import SolveError
from ..oscillators.netlist import TOLERANCES, netlist_text
from ..oscillators.network import Network
from ..simulation.response import transient_band
from ..strip.actuator import Actuator

if TYPE_CHECKING:
    from ..solve.ngspice import Run

#: Error of the strains, relative to their largest value, beyond which a solve has failed.
_LARGEST_ERROR = 1e-3
#: The first step, of first order, is so short in units of the first interval.
_LAUNCH = 1e-4
#: With the neurons steps are halved until the strains move by less than this part of their largest, but not more often.
_NEURONS_ACCURACY = 2e-5
_MOST_HALVINGS = 4


def through_circuits(strip: Actuator, times: Array, voltages: Array) -> tuple[Array, Array, float]:
    """Return charges [C] on the ion path and free strains (t, n) of the strips of all segments, and the strains' error.

    The strips are under ``voltages`` [V] (t, n), straight between even ``times`` [s] (t,) from 0; strains are those of
    the face towards the cathode, their error is relative to the largest. ngspice's trapezoidal rule on these times,
    then with every step halved; Richardson's extrapolation of the two is the result, a third of their difference its
    error. Raises SolveError when ngspice fails or is uncertain by 1e-3.
    """
    netlist = strip_netlist(strip, beam="static", band=transient_band(times))
    drives = [f"{netlist.source.nodes[1]} external"] * voltages.shape[1]
    coarse, fine, _, error = _refined(strip, netlist, drives, times, voltages, halvings=1)
    charges, strains = fine + (fine - coarse) / 3
    return charges, strains, error


def with_neurons(
    strip: Actuator,
    times: Array,
    network: Network,
    start: Array,
    of_segment: NDArray[np.intp],
    voltage: float,
    reference: float,
) -> tuple[Array, Array, float, Array, Array]:
    """Return charges, strains, error as `through_circuits`, then outputs and voltages [V]; all (t, n) but the error.

    The network from ``start`` (2 n,) and the strips are one netlist, solved at even ``times`` [s] (t,) from 0.
    ``of_segment`` (segments,) is the unit of each segment; ``voltage`` Vmax [V], ``reference`` A_ref. Where in a step
    a neuron switches is chance, so nothing is extrapolated: steps are halved until the strains stand, and a third of
    the last change is the error.
    """
    netlist = strip_netlist(strip, beam="static", band=transient_band(times))
    pairs = {unit: network.units[unit] for unit in np.unique(of_segment).tolist()}
    sources = [
        f"Bu{unit} u{unit} 0 V = {voltage!r}*max(-1, min(1, (v(y{one + 1})-v(y{two + 1}))/{reference!r}))"
        for unit, (one, two) in pairs.items()
    ]
    neurons = "\n".join([netlist_text(network, start).rstrip(), *sources])
    drives = [f"u{unit} 0.0" for unit in of_segment.tolist()]
    driving = sorted({k for pair in pairs.values() for k in pair})
    more = [*(f"y{k + 1}" for k in driving), *(f"u{unit}" for unit in pairs)]
    _, (charges, strains), waves, error = _refined(
        strip, netlist, drives, times, np.zeros((len(times), 1)), halvings=_MOST_HALVINGS, neurons=neurons, more=more
    )
    y = np.zeros((network.size, len(times)))
    for k in driving:
        y[k] = np.append(max(start[k], 0.0), waves[f"y{k + 1}"])
    outputs = (network.readout @ y).T
    driven = voltage * np.clip(outputs[0] / reference, -1.0, 1.0)  # the sources at 0, which ngspice does not return
    voltages = np.stack([np.append(driven[unit], waves[f"u{unit}"]) for unit in of_segment.tolist()], axis=1)
    return charges, strains, error, outputs[:, of_segment], voltages


def _refined(
    strip: Actuator,
    netlist: Netlist,
    drives: list[str],
    times: Array,
    voltages: Array,
    *,
    halvings: int,
    neurons: str = "",
    more: Iterable[str] = (),
) -> tuple[Array, Array, dict[str, Array], float]:
    """Return charges and strains (2, t, n) of the two finest steps, the vectors of the last, ``more`` too, its error.

    ``netlist`` has a copy for each of ``drives``, second node and value of the copy's own source, after the text of
    the ``neurons``. Steps are halved at least once, and so many times at most, until the strains stand. Raises
    SolveError where they do not.
    """
    from ..solve.ngspice import session

    text, vectors = copies([netlist] * len(drives))
    plus = netlist.source.nodes[0]
    for k, drive in enumerate(drives):
        source = f"{netlist.drive}_{k} {plus}_{k} "
        text = text.replace(f"{source}{plus} 0.0", f"{source}{drive}")
    if neurons:
        _, _, strips = text.partition("\n")
        text = "\n".join([neurons, strips, TOLERANCES])
    names = list(dict.fromkeys([*more, *(v for of_copy in vectors for v in of_copy.values())]))
    found: list[Array] = []
    with session().loaded(text, float(times[-1]), names, linear=netlist.linear) as run:
        for halving in range(halvings + 1):
            waves = dict(zip(names, _solved(run, times, voltages, 2**halving), strict=True))
            found.append(_read(strip, netlist, vectors, waves))
            if halving and _change(found[-2][1], found[-1][1]) <= _NEURONS_ACCURACY:
                break
    error = _change(found[-2][1], found[-1][1])
    if error > _LARGEST_ERROR:
        raise SolveError(f"ngspice's strains are uncertain by {error:.1e} of the largest; shorten the run")
    return found[-2], found[-1], waves, error


def _solved(run: Run, times: Array, voltages: Array, parts: int) -> Array:
    """Return the vectors at ``times`` (t,) after 0 under ``voltages`` [V] (t, n), from a start of short steps on.

    Every interval is divided into so many ``parts``.
    """
    launch = times[1] * 2.0 ** np.arange(np.floor(np.log2(_LAUNCH)), 0)
    nodes = np.concatenate([[0.0], launch, times[1:]])
    inner = nodes[:-1, None] + np.diff(nodes)[:, None] * np.arange(parts) / parts
    grid = np.append(inner.ravel(), nodes[-1])
    waves = np.array([np.interp(grid, times, voltage) for voltage in voltages.T])
    return run(grid, waves)[:, parts - 1 :: parts][:, len(launch) :]


def _read(strip: Actuator, netlist: Netlist, vectors: list[dict[str, str]], waves: dict[str, Array]) -> Array:
    """Return the charges [C] and free strains (2, t, n), the start included."""
    found = np.zeros((2, len(next(iter(waves.values()))) + 1, len(vectors)))
    for k, name in enumerate(("charge", "displacement")):
        terms = next(o for o in netlist.outputs if o.name == name).terms
        found[k, 1:] = np.transpose([sum(c * waves[of_copy[q]] for q, c in terms) for of_copy in vectors])
    found[1] *= strip.geometry.thickness
    found[1] /= strip.geometry.length**2
    return found


def _change(before: Array, after: Array) -> float:
    """Return a third of the largest change, relative to the largest value: the error of a rule of second order."""
    largest = float(np.abs(after).max())
    return float(np.abs(after - before).max() / 3 / largest) if largest else 0.0
