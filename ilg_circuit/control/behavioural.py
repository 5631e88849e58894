"""The loop as one circuit in ngspice: the strip's netlist and a law, as behavioural sources or as op-amps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..circuit.deck import transient_lines
from ..circuit.netlist import Netlist, copies, plain
from ..circuit.provenance import FIRST_STEP, TIGHT_OPTIONS
from ..drive import Drive
from ..errors import InputError, SolveError, argument
from .laws import Law
from .op_amps import Controller
from .sampled import ACCURACY, Waves

#: Volts that stand for a metre: 1 V is 1 mm.
_MM = 1e3
#: Steps of the first run and at most, and part of a step before the first point, where the reference has jumped.
_FIRST, _MOST, _SOON = 1500, 200_000, 1e-6


@dataclass(frozen=True)
class Looped:
    """A loop as a circuit but for its reference: a strip, lines, ngspice's vector of each quantity of the strip.

    ``scale`` [V/m] is what v(reference) and v(sensed) are of a length; ``options`` are ngspice's in
    a deck, ``solver`` those of our own run that differ from the session's.
    """

    net: Netlist
    lines: tuple[str, ...]
    vectors: Mapping[str, str]
    scale: float
    about: str
    options: str = TIGHT_OPTIONS
    solver: tuple[str, ...] = ()


def run_looped(loop: Looped, reference: Drive, times: Array) -> Waves:
    """Return the loop by ngspice at ``times`` [s] (n,) equally apart from 0, to `sampled.ACCURACY`.

    Steps are halved until the displacement moves by less than that. Raises SolveError where it is not reached.
    """
    from ..solve.ngspice import session

    net, vectors = loop.net, loop.vectors
    body = "\n".join([*loop.lines, *(f".options {word}" for word in loop.solver), "Vreference reference 0 external"])
    names = [net.source.nodes[0], *dict.fromkeys(vectors.values())]
    terms = {output.name: output.terms for output in net.outputs}
    parts, before, error = -(-_FIRST // (len(times) - 1)), None, np.inf
    with session().loaded(body, float(times[-1]), names, linear=False) as run:
        while parts * (len(times) - 1) <= _MOST:
            width = float(times[1] - times[0]) / parts
            grid, at = _grid(times, parts, _SOON * width, reference)
            values = run(grid, loop.scale * reference.value(grid))
            found = {name: values[k][at] for k, name in enumerate(names)}
            waves = {
                n: np.asarray(sum(k * found[vectors[q]] for q, k in terms[n])) for n in ("displacement", "current")
            }
            if before is not None:
                moved = float(np.abs(waves["displacement"] - before).max())
                error = moved / 3 / max(float(np.abs(waves["displacement"]).max()), 1e-300)
                if error <= ACCURACY:
                    none = np.empty(0)
                    return Waves(times, waves["displacement"], waves["current"], found[names[0]], none, none, error)
            before, parts = waves["displacement"], 2 * parts
    raise SolveError(f"ngspice's loop moves by {error:.1e} of its largest displacement, not {ACCURACY:g}")


def _grid(times: Array, parts: int, soon: float, reference: Drive) -> tuple[Array, Array]:
    """Return points [s] from 0 (m,), and where ``times`` are among those after 0; just after 0 stands for 0.

    Every interval has ``parts`` steps; the reference may jump at 0 and its breakpoints, within ``soon`` [s].
    """
    end, count = float(times[-1]), parts * (len(times) - 1)
    regular = np.arange(count + 1) * (end / count)
    jumps = np.asarray(reference.breakpoints(end))
    jumps = jumps[(jumps > 2 * soon) & (jumps < end - 2 * soon)]
    far = np.abs(regular[np.clip(np.rint(jumps * count / end).astype(int), 0, count)] - jumps) > 2 * soon
    # steps grow by two, which the two-step rule still follows
    after = jumps[:, None] + soon * 2.0 ** np.arange(int(-np.log2(_SOON)))
    after = after[after < end - 2 * soon]
    grid = np.unique(np.concatenate([regular, [soon], jumps - soon, after.ravel(), jumps[far]]))
    return grid, np.append(0, np.searchsorted(grid, regular[parts::parts]) - 1)


def loop_deck(loop: Looped, reference: Drive, duration: float) -> str:
    """Return a deck of the loop that plain ``ngspice -b`` runs."""
    step = duration / 600
    printed = f"v(reference) v(sensed) v({loop.net.source.nodes[0]})"
    lines = [
        f"* {plain(loop.net.title)}: closed loop, {loop.about}",
        f"* v(reference), v(sensed): {loop.scale / _MM:g} V = 1 mm; v(drive) is the voltage on the strip, limited",
        *loop.lines[1:],
        f"Vreference reference 0 {_waveform(reference, duration, loop.scale)}",
        *transient_lines(duration, step, step / 20, printed, options=loop.options),
    ]
    return "\n".join([*lines, ".end", ""])


def behavioural(net: Netlist, law: Law, limit: float) -> Looped:
    """Return the loop with a law as behavioural sources. Raises InputError for a law whose integral is clamped."""
    if law.clamps:
        raise InputError(f"{argument('anti_windup', 'clamping')} has no circuit here; take back-calculation or none")
    text, vectors = _strip(net, _MM)
    states = [f"v(state{k})" for k in range(1, len(law.out) + 1)]
    asked = [
        *zip(law.out, states, strict=True),
        (law.reference / _MM, "v(reference)"),
        (law.measured / _MM, "v(sensed)"),
    ]
    lines = [
        *text,
        f"Basked asked 0 V={_sum(asked)}",
        f"Bdrive {net.source.nodes[0]} 0 V=max(min(v(asked),{limit!r}),{-limit!r})",
    ]
    for k, own in enumerate(law.a):
        rate = [
            *zip(own, states, strict=True),
            (law.into_reference[k] / _MM, "v(reference)"),
            (law.into_measured[k] / _MM, "v(sensed)"),
            (law.into_excess[k], f"(v({net.source.nodes[0]})-v(asked))"),
        ]
        lines += [f"Bstate{k + 1} 0 state{k + 1} I={_sum(rate)}", f"Cstate{k + 1} state{k + 1} 0 1 ic=0"]
    return Looped(net, tuple(lines), vectors, _MM, law.kind)


def with_op_amps(net: Netlist, controller: Controller) -> Looped:
    """Return the loop with a controller of operational amplifiers."""
    scale = controller.op_amps.sensor_gain
    text, vectors = _strip(net, scale)
    # a fast amplifier rings for ever with the trapezoidal rule; its gain times rounding is above the finest tolerances
    solver = ("method=gear", "reltol=1e-8", "vntol=1e-9")
    options = TIGHT_OPTIONS.replace("method=trap", "method=gear")
    lines = [*text, *controller.lines(net.source.nodes[0])]
    return Looped(net, tuple(lines), vectors, scale, "PI of operational amplifiers", options, solver)


def _strip(net: Netlist, scale: float) -> tuple[list[str], dict[str, str]]:
    """Return the lines of a strip and its sensor of ``scale`` [V/m], and the vector of each quantity."""
    text, (vectors,) = copies([net])
    terms = next(output.terms for output in net.outputs if output.name == "displacement")
    measured = _sum([(k * scale, f"v({vectors[q]})") for q, k in terms])
    return [*text.splitlines(), f"Bsensed sensed 0 V={measured}"], vectors


def _sum(terms: Sequence[tuple[float, str]]) -> str:
    """Return a sum as an expression; terms of zero are left out."""
    return "+".join(f"({float(k)!r})*{name}" for k, name in terms if k) or "0"


def _waveform(reference: Drive, duration: float, scale: float) -> str:
    """Return the reference as the waveform of a source of ``scale`` [V/m]."""
    jumps = np.asarray(reference.breakpoints(duration))
    jumps = jumps[jumps > 0]
    times = np.unique(np.concatenate([np.linspace(0.0, duration, 601), jumps - FIRST_STEP * duration, jumps]))
    points = [f"{t!r} {v!r}" for t, v in zip(times.tolist(), (scale * reference.value(times)).tolist(), strict=True)]
    return "PWL(" + " ".join(points) + ")"
