"""The command `ilg-circuit arm`: a soft arm's motion."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from ..extras import require_arm
from .emit import emit, say
from .options import NUMBER, SEED
from .paths import ANY, MOTION, PICTURE, LongCommand
from .progress import ProgressBar


@click.command(cls=LongCommand)
@click.option("--actuator", default="paper", help="Strip that a beam is cut from: TOML or preset.")
@click.option("--segments", type=int, default=15)
@click.option("--formulation", type=click.Choice(["beam", "yekutieli"]), default="beam")
@click.option("--coupling", type=click.Choice(["ideal", "circuit", "charge"]), default="ideal")
@click.option("--activation", type=click.Choice(["cpg", "sine", "wave"]), default="cpg")
@click.option("--rhythm", type=click.Choice(["unit", "ring", "one-way-ring", "chain"]), default="unit")
@click.option("--inhibition", type=NUMBER, help="a of the rhythm.  [default: 2.5]")
@click.option("--tonic", type=NUMBER, help="e of the rhythm.  [default: 1]")
@click.option("--adaptation", type=NUMBER, help="d of the rhythm.  [default: 3]")
@click.option("--rise-time", help="Tr of the rhythm.  [default: 0.12s]")
@click.option("--reference", type=NUMBER, help="Output that gives --voltage.  [default: the rhythm's amplitude]")
@click.option("--slower", type=NUMBER, default=1.0, help="Stretches the rhythm's time constants.")
@click.option("--neurons-in-circuit", is_flag=True, help="The neurons, too, in the netlist of the strips.")
@click.option("--voltage", default="4V", help="Largest voltage on a segment's strip.")
@click.option("--reach", help="Find a rhythm that brings the tip to x,y, such as 29mm,4mm; the base is 0,0.")
@click.option("--within", help="How near counts as reached.  [default: a hundredth of the arm's length]")
@click.option("--seed", type=SEED, default=0, help="Of the search for --reach.")
@click.option("--amplitude", type=NUMBER, help="Of a sine: strain or activation.  [default: 0.00221; yekutieli: 0.02]")
@click.option("--period", help="Period of a sine.  [default: 1.035463s]")
@click.option("--mounting", type=click.Choice(["weightless", "hanging", "horizontal"]), help="[default: the strip's]")
@click.option("--settled", is_flag=True, help="Begin in equilibrium under the weight, not in the rest shape.")
@click.option("--rest-ratio", type=NUMBER, help="Pre-tension of yekutieli: rest over initial length.  [default: 0.5]")
@click.option("--method", type=click.Choice(["auto", "explicit", "implicit"]), default="auto")
@click.option("--tolerance", type=NUMBER, help="Error of a step, of the thickness.  [default: 1e-06]")
@click.option("--duration", required=True, help="How long, such as 3s.")
@click.option("--samples", type=int, help="Number of samples.  [default: 601]")
@click.option("--step", help="Time between samples, such as 10ms; instead of --samples.")
@click.option("--out", type=MOTION, required=True, help="netCDF file to write.")
@click.option("--animate", "animation", type=ANY, help="Animation to write (.gif, or .mp4 where ffmpeg is).")
@click.option("--plot", type=PICTURE, help="Picture to write (.png, .pdf, .svg).")
def arm(duration: str, out: Path, animation: Path | None, plot: Path | None, **options: Any) -> None:
    """Move a soft arm and write its motion.

    beam: the free part of a strip whose faces change length (eigenstrain). yekutieli: an octopus-sized arm of
    pre-tensioned muscles in sea water. A rhythm of neurons drives the segments, directly (ideal) or through the
    circuits of their strips; or a sine, or the octopus' wave of stiffness (yekutieli). With --reach the rhythm is
    looked for, and --plot shows the places that the tip can come to.
    """
    require_arm()
    from ..arms.run import PERIOD, ArmResult
    from ..arms.run import arm as move
    from ..report.motion import animate, require_animation

    outputs = {"--out": out, "--animate": animation, "--plot": plot}
    if animation:
        require_animation(animation)
    reach, options["period"] = options["reach"], options["period"] or PERIOD
    if sys.stderr.isatty() and not any(Path(__file__).parents[1].glob("arms/__pycache__/*plicit-*.nbi")):
        say("compiling the arm's kernels, half a minute or so, once after an installation", err=True)
    strip = options.pop("actuator")
    result = move(
        duration, strip, progress=ProgressBar("", doing="moving" if reach is None else "searching"), **options
    )

    def write_animation(made: ArmResult, path: Path) -> None:
        animate(made.motion, path, portrait=made.coupled.portrait(made.motion.time) if made.coupled else None)

    emit(
        result,
        outputs,
        inputs=(strip,),
        seed=None if reach is None else options["seed"],
        writers={"--out": lambda made, path: made.write_netcdf(path), "--animate": write_animation},
    )
