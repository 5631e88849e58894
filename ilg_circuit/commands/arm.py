"""The command `ilg-circuit arm`: a soft arm's motion."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from ..extras import require_arm
from .progress import ProgressBar

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..arm import Activation, Arm, Motion
    from ..arm.coupling import Coupled
    from ..arm.reach import Reached

_OUT = click.Path(path_type=Path)

#: Free strain of the `paper` strip at 4 V, 3 d0 V/b, and a level at which the octopus arm bends as far as it may.
_AMPLITUDES = {"beam": 2.21e-3, "yekutieli": 0.02}
#: Period of the two-neuron oscillator at the paper's values.
_PERIOD = "1.035463s"
#: As in `ilg_circuit.arm.dynamics`, which is slow to import.
_STEP_TOLERANCE = 1e-6


@click.command()
@click.option("--actuator", default="paper", show_default=True, help="Strip that a beam is cut from: TOML or preset.")
@click.option("--segments", type=int, default=15, show_default=True)
@click.option("--formulation", type=click.Choice(["beam", "yekutieli"]), default="beam", show_default=True)
@click.option("--coupling", type=click.Choice(["ideal", "circuit", "charge"]), default="ideal", show_default=True)
@click.option("--activation", "kind", type=click.Choice(["cpg", "sine", "wave"]), default="cpg", show_default=True)
@click.option(
    "--rhythm", type=click.Choice(["unit", "ring", "one-way-ring", "chain"]), default="unit", show_default=True
)
@click.option("--inhibition", type=float, help="a of the rhythm.  [default: 2.5]")
@click.option("--tonic", type=float, help="e of the rhythm.  [default: 1]")
@click.option("--adaptation", type=float, help="d of the rhythm.  [default: 3]")
@click.option("--rise-time", help="Tr of the rhythm.  [default: 0.12s]")
@click.option("--reference", type=float, help="Output that gives --voltage.  [default: the rhythm's amplitude]")
@click.option("--slower", type=float, default=1.0, show_default=True, help="Stretches the rhythm's time constants.")
@click.option("--neurons-in-circuit", is_flag=True, help="The neurons, too, in the netlist of the strips.")
@click.option("--voltage", default="4V", show_default=True, help="Largest voltage on a segment's strip.")
@click.option("--reach", "target", help="Find a rhythm that brings the tip to x,y, such as 29mm,4mm; the base is 0,0.")
@click.option("--within", help="How near counts as reached.  [default: a hundredth of the arm's length]")
@click.option("--seed", type=int, default=0, show_default=True, help="Of the search for --reach.")
@click.option("--amplitude", type=float, help="Of a sine: strain or activation.  [default: 0.00221; yekutieli: 0.02]")
@click.option("--period", default=_PERIOD, show_default=True, help="Period of a sine.")
@click.option("--mounting", type=click.Choice(["weightless", "hanging", "horizontal"]), help="[default: the strip's]")
@click.option("--settled", is_flag=True, help="Begin in equilibrium under the weight, not in the rest shape.")
@click.option("--rest-ratio", type=float, help="Pre-tension of yekutieli: rest over initial length.  [default: 0.5]")
@click.option("--method", type=click.Choice(["auto", "explicit", "implicit"]), default="auto", show_default=True)
@click.option(
    "--tolerance", type=float, default=_STEP_TOLERANCE, show_default=True, help="Error of a step, of the thickness."
)
@click.option("--duration", required=True, help="How long, such as 3s.")
@click.option("--samples", type=int, help="Number of samples.  [default: 601]")
@click.option("--step", help="Time between samples, such as 10ms; instead of --samples.")
@click.option("--out", type=_OUT, required=True, help="netCDF file to write.")
@click.option("--animate", "animation", type=_OUT, help="Animation to write (.gif, or .mp4 where ffmpeg is).")
@click.option("--plot", type=_OUT, help="Picture to write (.png, .pdf, .svg).")
def arm(duration: str, step: str | None, out: Path, animation: Path | None, plot: Path | None, **options: Any) -> None:
    """Move a soft arm and write its motion.

    beam: the free part of a strip whose faces change length (eigenstrain). yekutieli: an octopus-sized arm of
    pre-tensioned muscles in sea water. A rhythm of neurons drives the segments, directly (ideal) or through the
    circuits of their strips; or a sine, or the octopus' wave of stiffness (yekutieli). With --reach the rhythm is
    looked for, and --plot shows the places that the tip can come to.
    """
    require_arm()
    from ..arm.plots import SNAPSHOT_TIMES, animate, plot_motion, plot_reach, require_animation
    from ..files import require_writable
    from ..report.axes import require_picture
    from ..simulation.response import sample_times
    from ..units import parse

    seconds = parse(duration, "s", "--duration")
    times = sample_times(seconds, samples=options["samples"], step=parse(step, "s", "--step") if step else None)
    outputs = [path for path in (out, animation, plot) if path]
    if len({path.resolve() for path in outputs}) < len(outputs):
        raise InputError("two of --out, --animate and --plot name the same file; give each its own")
    require_writable(out)
    if animation:
        require_animation(animation)
    if plot:
        require_picture(plot)
    _require_consistent(options)
    body = _arm(options)
    found: Reached | None = None
    coupled: Coupled | None = None
    if options["target"] is not None:
        found = _reached(body, options, seconds, times)
        motion, coupled = found.motion, found.coupled
    else:
        motion, coupled = _moved(body, options, seconds, times)
    motion.write(out)
    if plot and found:
        plot_reach(found, plot)
    elif plot:
        plot_motion(motion, plot, snapshots=[options["slower"] * time for time in SNAPSHOT_TIMES])
    if animation:
        animate(motion, animation, portrait=coupled.portrait(motion.time) if coupled else None)
    for line in _summary(motion):
        click.echo(line)
    if coupled:
        click.echo(coupled.table())
    if found:
        click.echo(found.text())
    for line in [*(coupled.warnings if coupled else ()), *motion.warnings]:
        click.echo(f"warning: {line}", err=True)


def _require_consistent(options: dict[str, Any]) -> None:
    """Refuse options that say nothing together."""
    rhythm = ("inhibition", "tonic", "adaptation", "rise_time", "reference")
    given = [k for k in rhythm if options[k] is not None]
    given += ["slower"] if options["slower"] != 1.0 else []
    given += ["neurons_in_circuit"] if options["neurons_in_circuit"] else []
    if options["target"] is None:
        if options["within"] is not None:
            raise InputError("--within goes with --reach")
    elif options["kind"] != "cpg":
        raise InputError(f"--reach looks for a rhythm; it does not go with --activation {options['kind']}")
    elif options["amplitude"] is not None:
        raise InputError("--amplitude is that of a sine; --reach looks for a rhythm")
    elif given:
        raise InputError(f"--reach finds the rhythm's parameters itself; leave out --{given[0].replace('_', '-')}")
    elif options["method"] != "auto" or options["tolerance"] != _STEP_TOLERANCE:
        raise InputError("--reach chooses method and tolerance itself; leave out --method and --tolerance")
    if options["kind"] != "cpg" and given:
        raise InputError(f"--{given[0].replace('_', '-')} belongs to --activation cpg")


def _moved(body: Arm, options: dict[str, Any], seconds: float, times: NDArray[Any]) -> tuple[Motion, Coupled | None]:
    """The motion that the options prescribe, and its rhythm."""
    from ..arm import simulate

    coupled = _coupled(body, options, seconds) if options["kind"] == "cpg" else None
    drive = coupled.activation(body) if coupled else _prescribed(body, options, seconds)
    _tell_of_compiling()
    how = {name: options[name] for name in ("method", "tolerance")}
    with ProgressBar("", doing="moving") as advance:
        motion = simulate(body, drive, times, start=_start(body, drive, options), progress=advance, **how)
    return (replace(motion, signals=coupled.signals(motion.time)) if coupled else motion), coupled


def _reached(body: Arm, options: dict[str, Any], seconds: float, times: NDArray[Any]) -> Reached:
    """The motion that comes nearest to a target."""
    from ..arm import passive
    from ..arm.reach import reach_target
    from ..strip.file import load_actuator
    from ..units import parse

    cells = options["target"].split(",")
    if len(cells) != 2:
        raise InputError(f"--reach '{options['target'][:40]}' is no place; write x,y with units, such as 29mm,4mm")
    target = [parse(cell, "m", f"--reach {axis}") for cell, axis in zip(cells, "xy", strict=True)]
    within = parse(options["within"], "m", "--within") if options["within"] is not None else None
    strip = load_actuator(options["actuator"])
    _tell_of_compiling()
    with ProgressBar("", doing="searching") as advance:
        return reach_target(
            body,
            target,
            seconds,
            rhythm_of=options["rhythm"],
            mode=options["coupling"],
            actuator=strip,
            voltage=parse(options["voltage"], "V", "--voltage"),
            times=times,
            tolerance=within,
            start=_start(body, passive(body), options),
            seed=options["seed"],
            progress=advance,
        )


def _tell_of_compiling() -> None:
    if sys.stderr.isatty() and not any(Path(__file__).parents[1].glob("arm/__pycache__/*plicit-*.nbi")):
        click.echo("compiling the arm's kernels, half a minute or so, once after an installation", err=True)


def _arm(options: dict[str, Any]) -> Arm:
    """The arm that the options describe."""
    from ..arm import OCTOPUS, strip_arm
    from ..arm.lattice import GRAVITY
    from ..strip.file import load_actuator

    segments, mounting = options["segments"], options["mounting"]
    if options["formulation"] == "beam":
        if options["rest_ratio"] is not None:
            raise InputError("--rest-ratio is the pre-tension of yekutieli; the beam formulation has none")
        return strip_arm(load_actuator(options["actuator"]), segments=segments, mounting=mounting)
    body = replace(OCTOPUS, segments=segments)
    if options["rest_ratio"] is not None:
        body = replace(body, muscle=replace(body.muscle, rest_ratio=options["rest_ratio"]))
    if mounting:
        body = replace(
            body,
            gravity=(0.0, 0.0 if mounting == "weightless" else -GRAVITY),
            direction=-math.pi / 2 if mounting == "hanging" else 0.0,
        )
    return body


def _coupled(body: Arm, options: dict[str, Any], seconds: float) -> Coupled:
    """A rhythm and what the coupling makes of it."""
    from ..arm.coupling import couple
    from ..cpg.network import INHIBITION, chain, ring, unit
    from ..strip.file import load_actuator
    from ..units import parse

    if options["amplitude"] is not None:
        raise InputError("--amplitude is that of a sine; a rhythm's is set by --voltage")
    inhibition = INHIBITION if options["inhibition"] is None else options["inhibition"]
    constants: dict[str, Any] = {k: options[k] for k in ("tonic", "adaptation") if options[k] is not None}
    if options["rise_time"] is not None:
        constants["rise_time"] = parse(options["rise_time"], "s", "--rise-time")
    networks = {
        "unit": lambda: unit(inhibition, **constants),
        "ring": lambda: ring(3, inhibition, **constants),
        "one-way-ring": lambda: ring(3, inhibition, one_way=True, **constants),
        "chain": lambda: chain(body.segments, inhibition, **constants),
    }
    strip = load_actuator(options["actuator"])
    length = body.segment_length if body.formulation == "beam" else None
    return couple(
        networks[options["rhythm"]](),
        body.segments,
        seconds,
        mode=options["coupling"],
        actuator=strip,
        segment_length=length,
        voltage=parse(options["voltage"], "V", "--voltage"),
        slower=options["slower"],
        reference=options["reference"],
        neurons_in_circuit=options["neurons_in_circuit"],
    )


def _start(body: Arm, drive: Activation, options: dict[str, Any]) -> tuple[Any, Any] | None:
    """Positions and velocities to begin with, None for the rest shape."""
    from ..arm.statics import equilibrium

    if not options["settled"]:
        return None
    positions, _ = equilibrium(body, drive)
    return positions, 0.0 * positions


def _prescribed(body: Arm, options: dict[str, Any], seconds: float) -> Activation:
    """Activation without a rhythm and without a circuit."""
    from ..arm import sine, stiffening_wave
    from ..units import parse

    if options["coupling"] != "ideal":
        raise InputError(f"--coupling {options['coupling']} goes with --activation cpg; a {options['kind']} is ideal")
    if options["kind"] == "wave":
        if options["amplitude"] is not None:
            raise InputError("--amplitude is that of the sine; the wave has its own levels")
        return stiffening_wave(body, seconds)
    amplitude = _AMPLITUDES[body.formulation] if options["amplitude"] is None else options["amplitude"]
    return sine(body, amplitude, parse(options["period"], "s", "--period"), seconds)


def _summary(motion: Motion) -> list[str]:
    """What the user sees of the motion."""
    import numpy as np

    from ..units import format_quantity

    body = motion.arm
    moved = np.linalg.norm(motion.tip - motion.tip[0], axis=1)
    largest = int(moved.argmax())
    tension = np.abs(motion.first_segment_force).max()
    lines = [
        f"{body.formulation}, {body.segments} segments, {format_quantity(body.length, 'm', 4)} long: {motion.text}, "
        f"{motion.time[-1]:g} s, {len(motion.time)} samples",
        f"tip's largest displacement {format_quantity(float(moved[largest]), 'm', 4)} "
        f"at {motion.time[largest]:.4g} s, at the end {format_quantity(float(moved[-1]), 'm', 4)}",
        f"largest tension in the first segment {format_quantity(float(tension), 'N', 4)}",
        f"cells' areas kept to {motion.area_drift:.1e}, energy balance closed to {motion.balance_error:.1e} of its "
        "largest term",
    ]
    return lines + [f"{e.time:.4g} s: {e.text}" for e in motion.events if not e.text.startswith("warning: ")]
