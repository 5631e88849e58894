"""The loop as one circuit: the strip's netlist and a law as behavioural sources, in ngspice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from ..circuit.deck import transient_lines
from ..circuit.netlist import Netlist, copies, plain
from ..drive import Drive
from ..errors import InputError, SolveError, argument
from .laws import Law
from .sampled import ACCURACY, Waves

#: Volts that stand for a metre: 1 V is 1 mm.
_MM = 1e3
#: Steps of the first run and at most, and part of a step before the first point, where the reference has jumped.
_FIRST, _MOST, _SOON = 1500, 200_000, 1e-6


def run_behavioural(net: Netlist, law: Law, reference: Drive, limit: float, times: Array) -> Waves:
    """Return the loop by ngspice at ``times`` [s] (n,) equally apart from 0, to `sampled.ACCURACY`.

    Steps are halved until the displacement moves by less than that. Raises InputError for a law whose integral is
    clamped, SolveError where the accuracy is not reached.
    """
    from ..solve.ngspice import session

    text, vectors = loop_lines(net, law, limit)
    body = "\n".join([*text, "Vreference reference 0 external"])
    names = [net.source.nodes[0], *dict.fromkeys(vectors.values())]
    terms = {output.name: output.terms for output in net.outputs}
    parts, before, error = -(-_FIRST // (len(times) - 1)), None, np.inf
    with session().loaded(body, float(times[-1]), names, linear=False) as run:
        while parts * (len(times) - 1) <= _MOST:
            width = float(times[1] - times[0]) / parts
            grid = np.append(_SOON * width, np.arange(1, parts * (len(times) - 1) + 1) * width)
            grid = np.append(0.0, grid)
            values = run(grid, _MM * reference.value(grid))
            # the first of the values is just after t = 0
            at = np.append(0, np.arange(1, len(times)) * parts)
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


def loop_deck(net: Netlist, law: Law, reference: Drive, limit: float, duration: float) -> str:
    """Return a deck of the loop that plain ``ngspice -b`` runs."""
    text, _ = loop_lines(net, law, limit)
    step = duration / 600
    lines = [
        f"* {plain(net.title)}: closed loop, {law.kind}",
        "* v(reference), v(sensed): 1 V = 1 mm; v(drive) is the voltage on the strip, limited",
        *text[1:],
        f"Vreference reference 0 {_millimetres(reference, duration)}",
        *transient_lines(duration, step, step / 20, "v(reference) v(sensed) v(drive)"),
    ]
    return "\n".join([*lines, ".end", ""])


def loop_lines(net: Netlist, law: Law, limit: float) -> tuple[list[str], dict[str, str]]:
    """Return the loop's lines but for the reference, and ngspice's vector of each quantity of the strip.

    Raises InputError for a law whose integral is clamped.
    """
    if law.clamps:
        raise InputError(f"{argument('anti_windup', 'clamping')} has no circuit here; take back-calculation or none")
    text, (vectors,) = copies([net])
    terms = next(output.terms for output in net.outputs if output.name == "displacement")
    measured = _sum([(k * _MM, f"v({vectors[q]})") for q, k in terms])
    states = [f"v(state{k})" for k in range(1, len(law.out) + 1)]
    asked = [
        *zip(law.out, states, strict=True),
        (law.reference / _MM, "v(reference)"),
        (law.measured / _MM, "v(sensed)"),
    ]
    lines = [
        *text.splitlines(),
        f"Bsensed sensed 0 V={measured}",
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
    return lines, vectors


def _sum(terms: Sequence[tuple[float, str]]) -> str:
    """Return a sum as an expression; terms of zero are left out."""
    return "+".join(f"({float(k)!r})*{name}" for k, name in terms if k) or "0"


def _millimetres(reference: Drive, duration: float) -> str:
    """Return the reference as the waveform of a source, 1 V = 1 mm."""
    times = np.union1d(np.linspace(0.0, duration, 601), reference.breakpoints(duration))
    points = [f"{t!r} {v!r}" for t, v in zip(times.tolist(), (_MM * reference.value(times)).tolist(), strict=True)]
    return "PWL(" + " ".join(points) + ")"
