"""`ilg-circuit cpg`: the central pattern generator on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from .progress import ProgressBar

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..cpg.network import Network

_OUT = click.Path(path_type=Path)
_TOPOLOGIES = ("mutual", "ring", "one-way-ring", "chain")
#: What --sweep may vary, and the unit it is given in; as in `ilg_circuit.cpg.sweep`, which is slow to import.
_SWEPT = {"inhibition": "", "adaptation": "", "tonic": "", "rise-time": "s", "adaptation-time": "s"}


@click.command()
@click.option("--neurons", type=int, help="How many.  [default: 2; 3 in a ring; 30 in a chain]")
@click.option("--topology", type=click.Choice(_TOPOLOGIES), help="How they inhibit one another.  [default: mutual]")
@click.option("--weights", type=_OUT, help="CSV file of W instead: row i, what inhibits neuron i.")
@click.option("--inhibition", type=float, help="a, every weight of the topology.  [default: 2.5]")
@click.option("--same", type=float, help="ks of a chain: + ks y_k from the unit before.  [default: 0.1]")
@click.option("--cross", type=float, help="kc of a chain: - kc y_(other k) from the unit before.  [default: 0.1]")
@click.option("--adaptation", type=float, default=3.0, show_default=True, help="d.")
@click.option("--tonic", type=float, default=1.0, show_default=True, help="e.")
@click.option("--rise-time", default="0.12s", show_default=True, help="Tr.")
@click.option("--adaptation-time", default="0.3s", show_default=True, help="Ta.")
@click.option("--start", help="x of each neuron, then v of each: 0.12,0,0,0.  [default: the paper's]")
@click.option("--duration", help="How long, such as 10s.")
@click.option("--samples", type=int, help="Number of samples.  [default: 100 in the shorter time constant]")
@click.option("--step", help="Time between samples, such as 1ms; instead of --samples.")
@click.option("--engine", type=click.Choice(["ode", "ngspice"]), default="ode", show_default=True)
@click.option("--sweep", "swept", help="inhibition=1:5:41: 41 values from 1 to 5; or tonic, rise-time=0.01s:1s:100...")
@click.option("--out", type=_OUT, help="CSV file to write.")
@click.option("--plot", type=_OUT, help="Picture to write (.png, .pdf, .svg).")
@click.option("--netlist", "deck_path", type=_OUT, help="Deck to write that plain ngspice -b runs.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def cpg(**options: Any) -> None:
    """A central pattern generator: whether it oscillates, period, amplitude, phases, outputs over time."""
    from ..files import require_writable
    from ..report.axes import require_picture

    _require_apart(options)
    for key in ("out", "deck_path"):
        if options[key]:
            require_writable(options[key])
    if options["plot"]:
        require_picture(options["plot"])
    if options["swept"]:
        _sweep(options)
    else:
        _run(options)


def _require_apart(options: dict[str, Any]) -> None:
    files = [options[k].resolve() for k in ("weights", "out", "plot", "deck_path") if options[k]]
    if len(set(files)) < len(files):
        raise InputError("two of --weights, --out, --plot and --netlist name the same file; give each its own")
    if options["weights"]:
        given = [k for k in ("neurons", "topology", "inhibition", "same", "cross") if options[k] is not None]
        if given:
            raise InputError(f"--weights says it all; leave out --{given[0]}")
    if options["topology"] != "chain":
        given = [k for k in ("same", "cross") if options[k] is not None]
        if given:
            raise InputError(f"--{given[0]} belongs to --topology chain")


def _run(options: dict[str, Any]) -> None:
    from ..cpg.report import default_times, describe, run, tabulate
    from ..simulation.response import sample_times
    from ..units import parse

    if options["duration"] is None:
        raise InputError("--duration is missing; say how long, such as --duration 10s")
    seconds = parse(options["duration"], "s", "--duration")
    network = _network(options)
    start = _start(options["start"])
    if options["samples"] is None and options["step"] is None:
        times = default_times(network, seconds)
    else:
        step = parse(options["step"], "s", "--step") if options["step"] else None
        times = sample_times(seconds, samples=options["samples"], step=step)
    with ProgressBar("s", total=seconds) as advance:
        result = run(network, times, start, engine=options["engine"], progress=advance)
    if options["out"]:
        result.write_csv(options["out"])
    if options["plot"]:
        from ..cpg.plots import plot_run

        plot_run(result, options["plot"])
    if options["deck_path"]:
        from ..cpg.netlist import deck
        from ..files import write_text

        write_text(options["deck_path"], deck(network, seconds, start))
    click.echo(json.dumps(describe(result), indent=2) if options["as_json"] else tabulate(result))
    for line in result.warnings:
        click.echo(f"warning: {line}", err=True)


def _sweep(options: dict[str, Any]) -> None:
    from ..cpg.plots import plot_sweep
    from ..cpg.sweep import sweep

    if options["engine"] != "ode" or options["deck_path"]:
        raise InputError("a sweep is solved by --engine ode and writes no netlist; leave out --engine and --netlist")
    unused = [k for k in ("duration", "samples", "step") if options[k] is not None]
    if unused:
        raise InputError(f"a sweep follows each network to its end; leave out --{unused[0]}")
    name, values = _swept_values(options["swept"])
    if name == "inhibition" and options["weights"]:
        raise InputError("inhibition belongs to a topology; with --weights sweep adaptation, tonic or a time")
    key = name.replace("-", "_")

    def build(value: float) -> Network:
        return _network(options, **{key: value})

    start = _start(options["start"])
    with ProgressBar("networks") as advance:
        found = sweep(build, name, values, start, progress=advance)
    if options["out"]:
        found.write_csv(options["out"])
    if options["plot"]:
        plot_sweep(found, options["plot"])
    table: list[dict[str, Any]] = [
        {name: value, "outcome": outcome}
        | {key: None if v != v else v for key, v in (("period_s", period), ("amplitude", amplitude))}
        for value, outcome, period, amplitude in zip(
            found.values.tolist(), found.outcomes, found.period.tolist(), found.amplitude.tolist(), strict=True
        )
    ]
    if options["as_json"]:
        click.echo(json.dumps({"parameter": name, "unit": _SWEPT[name], "rows": table}, indent=2))
        return
    click.echo(f"{name:<18}{'outcome':<12}{'period [s]':>12}{'amplitude':>12}")
    for row in table:
        period, amplitude = ("" if row[k] is None else f"{row[k]:.6g}" for k in ("period_s", "amplitude"))
        click.echo(f"{row[name]:<18.6g}{row['outcome']:<12}{period:>12}{amplitude:>12}")


def _network(options: dict[str, Any], **changed: float) -> Network:
    """The network of the options, with some constants (SI) in place of theirs."""
    from ..cpg import network as wirings
    from ..units import parse

    times = {
        key: changed[key] if key in changed else parse(options[key], "s", f"--{key.replace('_', '-')}")
        for key in ("rise_time", "adaptation_time")
    }
    constants = {key: changed.get(key, options[key]) for key in ("adaptation", "tonic")} | times
    if options["weights"]:
        return wirings.Network(wirings.read_weights(options["weights"]), **constants)
    a = changed.get("inhibition", wirings.INHIBITION if options["inhibition"] is None else options["inhibition"])
    topology, neurons = options["topology"] or "mutual", options["neurons"]
    if topology == "chain":
        neurons = 30 if neurons is None else neurons
        if neurons % 2:
            raise InputError(f"a chain of {neurons} neurons: its units have two each, so give an even number")
        couplings = {k: options[k] for k in ("same", "cross") if options[k] is not None}
        return wirings.chain(neurons // 2, a, **couplings, **constants)
    if topology == "mutual":
        weights = wirings.mutual_weights(2 if neurons is None else neurons, a)
    else:
        build = wirings.ring_weights if topology == "ring" else wirings.one_way_ring_weights
        weights = build(3 if neurons is None else neurons, a)
    return wirings.Network(weights, **constants)


def _start(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(cell) for cell in text.split(",")]
    except ValueError:
        raise InputError(f"--start '{text[:40]}' is no list of numbers; write it like 0.12,0,0,0") from None


def _swept_values(text: str) -> tuple[str, NDArray[Any]]:
    """Parameter and its values in SI from ``name=from:to:count``."""
    import numpy as np

    from ..cpg.sweep import MOST_VALUES
    from ..units import parse

    name, _, rest = text.partition("=")
    parts = rest.split(":")
    name = name.strip()
    if name not in _SWEPT:
        raise InputError(f"cannot sweep '{name}'; choose one of {', '.join(_SWEPT)}, as in inhibition=1:5:41")
    if len(parts) != 3:
        raise InputError(f"--sweep '{text}' is not understood; write it like inhibition=1:5:41, from, to and how many")
    low, high = (parse(part.strip(), _SWEPT[name], f"--sweep {name}") for part in parts[:2])
    if not parts[2].strip().isdecimal() or not 1 <= int(parts[2]) <= MOST_VALUES:
        raise InputError(f"--sweep: '{parts[2]}' is no number of values; give 1 to {MOST_VALUES}")
    return name, np.linspace(low, high, int(parts[2]))
