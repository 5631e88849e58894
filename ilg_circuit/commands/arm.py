"""The command `ilg-circuit arm`: a soft arm's motion."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from ..extras import require_arm
from .emit import emit, say
from .help import group
from .options import NUMBER, SEED, plot_option
from .paths import ANY, MOTION, LongCommand
from .progress import ProgressBar


@click.command(
    cls=LongCommand,
    examples=(
        "arm --duration 3s --out motion.nc --animate motion.gif",
        "arm --coupling circuit --rhythm chain --voltage 2V --duration 5s --out motion.nc --plot motion.png",
        "arm --reach 29mm,4mm --duration 3s --out motion.nc",
    ),
)
@group(
    "Arm",
    click.option(
        "--actuator",
        default="paper",
        metavar="ACTUATOR",
        help="Strip that a beam is cut from: TOML file or preset.",
    ),
    click.option(
        "--segments",
        type=int,
        metavar="N",
        help="Number of segments.  [default: 15; of a lattice as many times two as keep its error below 1 %]",
    ),
    click.option(
        "--formulation",
        type=click.Choice(["beam", "chain", "yekutieli"]),
        default="beam",
        help="beam: a strip whose faces change length, as a lattice; chain: the same as arcs, without shear; "
        "yekutieli: an octopus arm of muscles in water.",
    ),
    click.option(
        "--mounting",
        type=click.Choice(["weightless", "hanging", "horizontal"]),
        help="How gravity acts.  [default: the strip's]",
    ),
    click.option("--settled", is_flag=True, help="Begin in equilibrium under the weight, not in the rest shape."),
    click.option(
        "--rest-ratio", type=NUMBER, help="Pre-tension of yekutieli: rest over initial length.  [default: 0.5]"
    ),
)
@group(
    "Activation",
    click.option(
        "--activation",
        type=click.Choice(["cpg", "sine", "wave"]),
        default="cpg",
        help="What drives the segments: a rhythm of neurons, a sine, or the octopus' wave of stiffness.",
    ),
    click.option(
        "--coupling",
        type=click.Choice(["ideal", "circuit", "charge"]),
        default="ideal",
        help="How a rhythm becomes strain: in proportion (ideal), through the whole circuit of each strip, or "
        "through its charge alone.",
    ),
    click.option("--voltage", default="4V", metavar="VOLTAGE", help="Largest voltage on a segment's strip."),
    click.option(
        "--amplitude",
        type=NUMBER,
        help="Amplitude of a sine: strain or activation.  [default: 0.00221; yekutieli: 0.02]",
    ),
    click.option("--period", metavar="TIME", help="Period of a sine.  [default: 1.035463s]"),
)
@group(
    "Rhythm",
    click.option(
        "--rhythm",
        type=click.Choice(["unit", "ring", "one-way-ring", "chain"]),
        default="unit",
        help="Network of the neurons: one unit of two, a ring of three, or a chain of units along the arm.",
    ),
    click.option("--inhibition", type=NUMBER, help="Mutual inhibition a of the neurons.  [default: 2.5]"),
    click.option("--tonic", type=NUMBER, help="Tonic input e of the neurons.  [default: 1]"),
    click.option("--adaptation", type=NUMBER, help="Adaptation (fatigue) d of the neurons.  [default: 3]"),
    click.option("--rise-time", metavar="TIME", help="Rise time Tr of the neurons.  [default: 0.12s]"),
    click.option("--slower", type=NUMBER, default=1.0, help="Factor on the rhythm's time constants."),
    click.option(
        "--reference",
        type=NUMBER,
        help="Output of the rhythm at which strips get --voltage.  [default: the rhythm's amplitude]",
    ),
    click.option("--neurons-in-circuit", is_flag=True, help="Put the neurons, too, into the netlist of the strips."),
)
@group(
    "Reaching",
    click.option(
        "--reach", metavar="X,Y", help="Find a rhythm that brings the tip here, such as 29mm,4mm; the base is 0,0."
    ),
    click.option(
        "--within", metavar="LENGTH", help="Distance that counts as reached.  [default: 1 % of the arm's length]"
    ),
    click.option("--seed", type=SEED, default=0, help="Seed of the search for --reach."),
)
@group(
    "Run",
    click.option("--duration", required=True, metavar="TIME", help="How long the run is, such as 3s."),
    click.option("--samples", type=int, metavar="N", help="Number of samples.  [default: 601]"),
    click.option("--step", metavar="TIME", help="Time between samples, such as 10ms; instead of --samples."),
    click.option(
        "--method",
        type=click.Choice(["auto", "explicit", "implicit"]),
        default="auto",
        help="Time integration; auto: whichever needs less work.",
    ),
    click.option(
        "--tolerance", type=NUMBER, help="Error allowed in a step, as a fraction of the thickness.  [default: 1e-06]"
    ),
)
@group(
    "Output",
    click.option("--out", type=MOTION, required=True, help="netCDF file to write."),
    click.option("--animate", "animation", type=ANY, help="Animation to write (.gif, or .mp4 where ffmpeg is)."),
)
@plot_option("Picture to write (.png, .pdf, .svg).")
def arm(duration: str, out: Path, animation: Path | None, plot: Path | None, **options: Any) -> None:
    """Move a soft arm and write its motion.

    The arm is the free part of a strip whose faces change length (beam), or an octopus-sized arm of pre-tensioned
    muscles in sea water (yekutieli). A rhythm of neurons drives its segments, or a sine, or the octopus' wave of
    stiffness (yekutieli). --reach searches for the rhythm, and --plot then shows the places that the tip can reach.
    """
    require_arm()
    from ..arms.run import ArmResult
    from ..front.arms import arm as move
    from ..report.animation import require_animation
    from ..report.motion import animate

    outputs = {"--out": out, "--animate": animation, "--plot": plot}
    if animation:
        require_animation(animation)
    reach = options["reach"]
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
