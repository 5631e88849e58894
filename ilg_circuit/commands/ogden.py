"""The command ``ilg-circuit ogden``."""

from __future__ import annotations

import json
from pathlib import Path

import click

from ..errors import InputError
from ..provenance import command_line

_PATH = click.Path(path_type=Path)


@click.command()
@click.option("--uniaxial", type=_PATH, help="Readings of a strip pulled (or a column pressed) along its length.")
@click.option("--equibiaxial", type=_PATH, help="Readings of a sheet pulled alike in both directions, or inflated.")
@click.option("--planar", type=_PATH, help="Readings of a wide, short sheet: pure shear.")
@click.option(
    "--terms", type=int, help="Ogden terms, 1 to 4.  [default: chosen by BIC, neo-Hookean and so on included]"
)
@click.option(
    "--model",
    type=click.Choice(["auto", "ogden", "neo-hookean", "mooney-rivlin"]),
    default="auto",
    show_default=True,
)
@click.option("--weights", type=click.Choice(["absolute", "relative"]), default="absolute", show_default=True)
@click.option("--free-signs", is_flag=True, help="Do not impose mu_i alpha_i > 0, which keeps the material stable.")
@click.option("--at", type=float, multiple=True, help="Stretch to predict the stress at; may be repeated.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--plot", type=_PATH, help="Picture of data, fit and predictions (.png, .pdf, .svg).")
@click.option("--report", type=_PATH, help="One HTML file with all of it.")
@click.option("--actuator", help="Strip that --out gives the fitted Young's modulus: TOML file or preset.")
@click.option("--out", type=_PATH, help="TOML file for that strip.")
def ogden(
    uniaxial: Path | None,
    equibiaxial: Path | None,
    planar: Path | None,
    terms: int | None,
    model: str,
    weights: str,
    free_signs: bool,
    at: tuple[float, ...],
    as_json: bool,
    plot: Path | None,
    report: Path | None,
    actuator: str | None,
    out: Path | None,
) -> None:
    """Fit a hyperelastic material to load tests, all of them together.

    Each file has the columns stretch and stress_<unit> (nominal), such as stress_MPa, with that header.
    """
    given = {"uniaxial": uniaxial, "equibiaxial": equibiaxial, "planar": planar}
    files = {mode: path for mode, path in given.items() if path is not None}
    if not files:
        raise InputError("no test was given; give at least one of --uniaxial, --equibiaxial, --planar with its file")
    if (out is None) != (actuator is None):
        missing, there = ("--actuator", "--out") if actuator is None else ("--out", "--actuator")
        raise InputError(f"{there} without {missing}: give the strip to start from and the file to write, or neither")

    from ..files import require_writable
    from ..hyperelastic import characterise, read_load_test
    from ..hyperelastic.report import plot_characterisation, table, to_json, write_actuator
    from ..report.axes import require_picture
    from ..strip.file import load_actuator

    named = [*files.values(), *(path for path in (plot, report, out) if path)]
    if len({path.resolve() for path in named}) < len(named):
        raise InputError("two of the tests, --plot, --report and --out name the same file; give each its own")
    for path in (out, report):
        if path:
            require_writable(path)
    if plot:
        require_picture(plot)
    base = load_actuator(actuator) if actuator else None
    tests = [read_load_test(path, mode) for mode, path in files.items()]
    result = characterise(tests, model=model, terms=terms, constrained=not free_signs, weighting=weights, at=at, seed=0)
    if out and base:
        write_actuator(result, base, out)
    if plot:
        plot_characterisation(result, plot)
    if report:
        from ..hyperelastic.html_report import write_report

        write_report(result, report, command_line())
    click.echo(json.dumps(to_json(result), indent=2) if as_json else table(result))
    for line in result.warnings:
        click.echo(f"warning: {line}", err=True)
