"""Neurons, their strips and the feedback as one ngspice netlist, solved in one transient.

The neurons are those of `netlist`, a copy of the strip's netlist for each unit, and between them

    Bu, Vdrive     u = Vmax max(-1, min(1, out/A_ref)), the voltage on the strip of a unit
    Bangle         the angle of its segment; 1 V is 1 rad
    Bs             the input s of each unit; Bi takes its current into the neurons' x
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..circuit.netlist import GROUND, copies
from ..errors import InputError, SolveError
from ..provenance import Provenance
from ..units import require_positive
from .netlist import DECK_OPTIONS, TOLERANCES, netlist_text
from .reflex import Loop

#: Steps of the first grid in the neurons' shorter time constant; largest ratio of two grids.
_STEPS_PER_CONSTANT, _FINER = 250, 8
#: Factor by which the error by two grids is stated larger.
_CAUTION = 2.0
_MOST_POINTS = 1_000_000
#: Error of the waves, relative to the largest, at which grids are fine enough.
ACCURACY = 1e-6


def loop_text(loop: Loop, start: Array) -> str:
    """Return the netlist without analysis: nodes x1.., v1.., y1.. of neurons; u1.., angle1.., s1.. of units."""
    network, count = loop.network, loop.units
    strips, vectors = copies([loop.netlist] * count)
    _, _, strips = strips.partition("\n")
    source = loop.netlist.source
    lines, rest = [], float(loop.rest_angle)
    for k, (extensor, flexor) in enumerate(network.units):
        own = f"{source.name}_{k} {source.nodes[0]}_{k} "
        strips = strips.replace(f"{own}{source.nodes[0]} 0.0", f"{own}u{k + 1} 0.0")
        share = f"(v(y{extensor + 1})-v(y{flexor + 1}))/{loop.reference!r}"
        angle = "+".join(f"({gain!r})*v({vectors[k][q]})" for q, gain in loop.netlist.outputs[0].terms)
        forced = "+v(forcing)" if loop.forcing else ""
        lines += [
            f"Bu{k + 1} u{k + 1} {GROUND} V={float(loop.voltage)!r}*max(-1, min(1, {share}))",
            f"Bangle{k + 1} angle{k + 1} {GROUND} V={angle}",
            f"Bs{k + 1} s{k + 1} {GROUND} V=({-float(loop.gain)!r})*(v(angle{k + 1})-({rest!r})){forced}",
        ]
    for i, row in enumerate(network.readout.T):
        felt = "+".join(f"({sign!r})*v(s{k + 1})" for k, sign in enumerate(row.tolist()) if sign)
        lines += [f"Bi{i + 1} {GROUND} x{i + 1} I={felt}"] if felt else []
    if loop.forcing:
        lines.append(f"Vforcing forcing {GROUND} SIN(0 {loop.forcing.amplitude!r} {loop.forcing.frequency!r})")
    return "\n".join([netlist_text(network, start).rstrip(), *lines, strips.rstrip()]) + "\n"


def loop_solve(loop: Loop, start: Array, duration: float, points: int) -> tuple[Array, Array, Array]:
    """Return a grid (points + 1,) over ``duration`` [s], x (n, points + 1) and angles (units, points + 1) [rad]."""
    from ..solve.ngspice import session

    names = [f"{kind}{k + 1}" for kind, n in (("x", loop.network.size), ("angle", loop.units)) for k in range(n)]
    grid = np.linspace(0.0, duration, points + 1)
    with session().loaded(loop_text(loop, start) + TOLERANCES, duration, names, linear=False) as run:
        found = run(grid, np.zeros(points + 1))
    n = loop.network.size
    inner = np.hstack([start[:n, None], found[:n]])
    at_once = loop.direct * loop.voltages(loop.network.readout @ np.maximum(start[:n], 0))
    angles = np.hstack([at_once[:, None], found[n:]])  # ngspice does not return the start, of strips at rest
    return grid, inner, angles


def loop_by_ngspice(loop: Loop, start: Array, times: Array) -> tuple[Array, Array, float]:
    """Return x (t, n) and angles (t, units) [rad] at ``times`` [s], and their error relative to the largest.

    The error goes with the square of the step, and is what the difference of two grids says of the finer one by that
    law. It is stated as twice that, since a neuron switches anywhere in a step. The next grid is finer by a whole
    number, as the error asks for, until it is 1e-6 or memory ends. Raises InputError for a run that is too long,
    SolveError for waves that are no numbers.
    """
    from scipy.interpolate import CubicSpline

    end = float(times[-1])
    require_positive("duration", end, "s")
    step = min(loop.network.rise_time, loop.network.adaptation_time) / _STEPS_PER_CONSTANT
    points = max(200, int(np.ceil(end / step)))
    if 2 * points > _MOST_POINTS:
        raise InputError(f"{end:g} s take {2 * points} steps of ngspice; at most {_MOST_POINTS} are possible")
    _, *before = loop_solve(loop, start, end, points)
    error, finer = np.inf, 2
    while error > ACCURACY and finer * points <= _MOST_POINTS:
        points *= finer
        grid, *waves = loop_solve(loop, start, end, points)
        pairs = zip(waves, before, strict=True)
        change = max(float(np.abs(a[:, ::finer] - b).max() / (np.abs(a).max() or 1.0)) for a, b in pairs)
        if not np.isfinite(change):
            raise SolveError("ngspice gave waves that are no numbers")
        expected = error / finer**2 if np.isfinite(error) else 0.0  # by the grids before
        error = max(_CAUTION * change / (finer**2 - 1), expected)
        most = _MOST_POINTS // points
        before, finer = waves, max(min(int(np.ceil(np.sqrt(error / ACCURACY))), _FINER, most), 2)
    states, bent = (np.asarray(CubicSpline(grid, wave.T)(times)) for wave in waves)
    return states, bent, error


def loop_deck(loop: Loop, start: Array, duration: float, provenance: Provenance | None = None) -> str:
    """Return a deck for plain ``ngspice -b``: the netlist, a transient over ``duration`` [s], a printed table."""
    title, _, body = loop_text(loop, start).partition("\n")
    step = duration / 2000
    longest = min(step, min(loop.network.rise_time, loop.network.adaptation_time) / 200)
    shown = " ".join(f"v({kind}{k + 1})" for k in range(loop.units) for kind in ("s", "u", "angle"))
    written, *more = (provenance or Provenance()).lines()
    header = [
        f"* {written}; 1 V stands for 1 of a neuron, and for 1 rad of an angle",
        *(f"* {line}" for line in more),
        "* nodes: x, v, y of each neuron; u (voltage on the strip), angle, s (input of the neurons) of each unit",
        "* run with: ngspice -b FILE",
    ]
    analysis = [DECK_OPTIONS, f".tran {step!r} {duration!r} 0 {longest!r} uic", f".print tran {shown}"]
    return "\n".join([f"{title} and their strips", *header, body.rstrip(), *analysis, ".end", ""])
