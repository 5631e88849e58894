"""The command ``ilg-circuit ogden``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..measurements.load_test import BRANCHES
from .emit import emit
from .help import group
from .options import NUMBER, plot_option, reading_options
from .paths import FILE, PAGE, STRIP, LongCommand, force_option


@click.command(
    cls=LongCommand,
    examples=(
        "ogden --uniaxial uniaxial.csv --planar planar.csv --at 2 --plot gel.png",
        "ogden --uniaxial pull.csv --length 20mm --section 10mm^2 --actuator paper --out soft.toml",
    ),
)
@group(
    "Input",
    click.option("--uniaxial", type=FILE, help="Load test of a strip pulled (or a column pressed) along its length."),
    click.option(
        "--equibiaxial", type=FILE, help="Load test of a sheet pulled equally in two directions, or inflated."
    ),
    click.option("--planar", type=FILE, help="Load test of a wide, short sheet: pure shear."),
    click.option(
        "--branch",
        type=click.Choice(BRANCHES),
        default="loading",
        help="Rows that are fitted if a test goes back and forth.",
    ),
)
@group(
    "Model",
    click.option(
        "--model",
        type=click.Choice(["auto", "ogden", "neo-hookean", "mooney-rivlin"]),
        default="auto",
        help="auto: chosen by BIC.",
    ),
    click.option("--terms", type=int, metavar="N", help="Ogden terms, 1 to 4.  [default: chosen by BIC]"),
    click.option(
        "--weights",
        "weighting",
        type=click.Choice(["absolute", "relative"]),
        default="absolute",
        help="relative: residuals are relative to each stress, so that small strains count more.",
    ),
    click.option("--free-signs", is_flag=True, help="Do not impose mu_i alpha_i > 0, which keeps the material stable."),
    click.option(
        "--at", type=NUMBER, multiple=True, metavar="STRETCH", help="Stretch to predict the stress at; may be repeated."
    ),
)
@reading_options
@group(
    "Data files",
    click.option(
        "--length",
        metavar="LENGTH",
        help="Free length of the specimens, such as 20mm, where a displacement was measured.",
    ),
    click.option(
        "--section", metavar="AREA", help="Their undeformed section, such as 10mm^2, where a force was measured."
    ),
)
@group(
    "Output",
    click.option("--json", "as_json", is_flag=True, help="Print JSON."),
)
@plot_option("Picture of data, fit and predictions (.png, .pdf, .svg).")
@group(
    "Output",
    click.option("--report", type=PAGE, help="HTML page with all results."),
    click.option(
        "--actuator",
        metavar="ACTUATOR",
        help="Strip (TOML file or preset) that --out writes with the fitted Young's modulus.",
    ),
    click.option("--out", type=STRIP, help="TOML file for that strip."),
)
@force_option
@click.pass_context
def ogden(
    context: click.Context, /, actuator: str | None, out: Path | None, as_json: bool, free_signs: bool, **options: Any
) -> None:
    """Fit one hyperelastic material to all load tests of a gel.

    Each file has the columns stretch and stress_<unit> (nominal), such as stress_MPa, with that header; or strain, or
    force and displacement.
    """
    if (out is None) != (actuator is None):
        missing, there = ("--actuator", "--out") if actuator is None else ("--out", "--actuator")
        raise InputError(f"{there} without {missing}: give the strip to start from and the file to write, or neither")

    from ..front.fits import ogden as fit
    from ..front.given import load
    from ..report.ogden import write_actuator

    outputs = {"--out": out, "--plot": options.pop("plot"), "--report": options.pop("report")}
    base = load(actuator or "paper")
    result = fit(constrained=not free_signs, **options)
    if not result.success:
        outputs["--out"] = None
    emit(
        result,
        outputs,
        inputs=(options["uniaxial"], options["equibiaxial"], options["planar"], actuator),
        seed=result.seed,
        writers={"--out": lambda found, path: write_actuator(found, base, path)},
        as_json=as_json,
    )
    if not result.success:
        context.exit(1)
