"""`ilg-circuit cpg`: the central pattern generator on the command line."""

from __future__ import annotations

from typing import Any

import click

from ..errors import InputError
from .emit import emit
from .help import group
from .options import NUMBER, plot_option
from .paths import DECK, FILE, TABLE, LongCommand
from .progress import ProgressBar


@click.command(
    cls=LongCommand,
    examples=(
        "cpg --duration 10s --out rhythm.csv --plot rhythm.png",
        "cpg --topology ring --inhibition 2 --duration 10s --json",
        "cpg --sweep inhibition=1:5:41 --out table.csv",
        "cpg --strip strip.toml --reflex 1 --inhibition 4.5 --duration 120s --plot reflex.png",
    ),
)
@group(
    "Network",
    click.option(
        "--neurons", type=int, metavar="N", help="Number of neurons.  [default: 2; 3 in a ring; 30 in a chain]"
    ),
    click.option(
        "--topology",
        type=click.Choice(["mutual", "ring", "one-way-ring", "chain"]),
        help="How the neurons inhibit one another.  [default: mutual]",
    ),
    click.option("--weights", type=FILE, help="CSV file of the weights W instead: row i holds what inhibits neuron i."),
    click.option("--inhibition", type=NUMBER, help="a, every weight of the topology.  [default: 2.5]"),
    click.option("--same", type=NUMBER, help="ks of a chain: + ks y_k from the unit before.  [default: 0.1]"),
    click.option("--cross", type=NUMBER, help="kc of a chain: - kc y_(other k) from the unit before.  [default: 0.1]"),
)
@group(
    "Neuron",
    click.option("--adaptation", type=NUMBER, default=3.0, help="d, strength of the adaptation (fatigue)."),
    click.option("--tonic", type=NUMBER, default=1.0, help="e, constant (tonic) input of each neuron."),
    click.option("--rise-time", default="0.12s", metavar="TIME", help="Tr, time constant of the state x."),
    click.option("--adaptation-time", default="0.3s", metavar="TIME", help="Ta, time constant of the adaptation v."),
    click.option(
        "--start",
        metavar="NUMBERS",
        help="Initial state: x of each neuron, then v of each: 0.12,0,0,0.  [default: the paper's]",
    ),
)
@group(
    "Reflex",
    click.option("--strip", type=FILE, help="Strip that the neurons drive and feel (TOML file, or paper)."),
    click.option("--reflex", type=NUMBER, help="Gain h [1/rad]: - h angle into the extensor, + h angle the flexor."),
    click.option("--rest-angle", type=NUMBER, help="Angle at which the reflex is silent [rad].  [default: 0]"),
    click.option("--voltage", metavar="VOLTAGE", help="Largest voltage on a segment of the strip.  [default: 4V]"),
    click.option(
        "--reference", type=NUMBER, help="Output that gives --voltage.  [default: the neurons' own amplitude]"
    ),
    click.option(
        "--entrain", type=NUMBER, help="Amplitude of a periodic input: the frequencies to which the rhythm locks."
    ),
)
@group(
    "Run",
    click.option("--duration", metavar="TIME", help="How long the run is, such as 10s."),
    click.option(
        "--samples", type=int, metavar="N", help="Number of samples.  [default: 100 in the shorter time constant]"
    ),
    click.option("--step", metavar="TIME", help="Time between samples, such as 1ms; instead of --samples."),
    click.option(
        "--engine",
        type=click.Choice(["ode", "ngspice"]),
        default="ode",
        help="ode: exact between thresholds; ngspice: the neurons as a circuit.",
    ),
    click.option(
        "--sweep",
        metavar="NAME=RANGE",
        help="Vary one parameter: inhibition=1:5:41 is 41 values from 1 to 5; or tonic, rise-time=0.01s:1s:100...; "
        "with --strip reflex=0:10:21.",
    ),
)
@group(
    "Output",
    click.option("--out", type=TABLE, help="CSV file to write."),
)
@plot_option("Picture to write (.png, .pdf, .svg).")
@group(
    "Output",
    click.option("--netlist", type=DECK, help="SPICE deck to write; it runs in plain ngspice -b."),
    click.option("--json", "as_json", is_flag=True, help="Print JSON."),
)
def cpg(sweep: str | None, as_json: bool, **options: Any) -> None:
    """Run a central pattern generator: period, amplitude, phases."""
    from ..oscillators.run import RhythmRun
    from ..oscillators.run import cpg as run

    outputs = {f"--{name}": options.pop(name) for name in ("out", "plot", "netlist")}
    felt = {name: options.pop(name) for name in _REFLEX}
    felt = {name: value for name, value in felt.items() if value is not None}
    files: dict[str, Any] = {"inputs": (options["weights"], felt.get("strip")), "as_json": as_json}
    if "strip" in felt:
        _reflex(sweep, options | felt, outputs, files)
    elif felt:
        raise InputError(f"--{next(iter(felt)).replace('_', '-')} needs the strip that the neurons feel; give --strip")
    elif sweep:
        if outputs["--netlist"]:
            raise InputError("a sweep writes no netlist; leave out --netlist")
        emit(run(sweep=sweep, progress=ProgressBar("networks"), **options), outputs, **files)
    else:
        result = run(progress=ProgressBar("s"), **options)
        emit(result, outputs, writers={"--netlist": RhythmRun.write_deck}, **files)


#: Options of the reflex; those but the strip mean nothing without it.
_REFLEX = ("strip", "reflex", "rest_angle", "voltage", "reference", "entrain")


def _reflex(sweep: str | None, options: dict[str, Any], outputs: dict[str, Any], files: dict[str, Any]) -> None:
    """Run neurons that feel a strip."""
    from ..front.reflexes import reflex as run
    from ..oscillators.loop_run import ReflexRun

    options["gain"] = options.pop("reflex", 0.0)
    strip = options.pop("strip")
    entrain = options.pop("entrain", None)
    if sweep is None and entrain is None:
        result = run(strip=strip, **options)
        emit(result, outputs, writers={"--netlist": ReflexRun.write_deck}, **files)
        return
    if outputs["--netlist"]:
        raise InputError("--netlist writes one run; leave it out of a sweep and of --entrain")
    doing = ProgressBar("rhythms" if sweep else "frequencies")
    options |= {"sweep": sweep, "entrain": entrain}
    emit(run(strip=strip, progress=doing, **options), outputs, **files)
