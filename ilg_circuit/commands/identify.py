"""The command ``identify``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..provenance import command_line
from .progress import evaluation_counter

_OUT = click.Path(path_type=Path)


@click.command()
@click.argument("data", type=click.Path(path_type=Path), nargs=-1, required=True)
@click.option("--actuator", help="The strip that was measured: its sizes, E, electrodes. TOML file or preset.")
@click.option(
    "--model",
    default="auto",
    show_default=True,
    help="rc, rc2, rc3, warburg, cpe, randles; +sinh, +growing, +inductance; auto.",
)
@click.option("--electrode-resistance", help="Held, such as 2ohm; fit: of several files.  [default: the actuator's]")
@click.option("--own", multiple=True, help="A parameter that each of several files has for itself; may be repeated.")
@click.option("--bias", multiple=True, help="Of spectra among several files: 1V, or FILE=1V for one of them.")
@click.option("--engine", type=click.Choice(["ngspice", "exact"]), default="ngspice", show_default=True)
@click.option(
    "--intervals",
    type=click.Choice(["covariance", "bootstrap", "profile", "mcmc"]),
    default="covariance",
    show_default=True,
    help="How 95 % intervals are made; covariance: by a block bootstrap where residuals are alike.",
)
@click.option("--out", type=_OUT, help="TOML file for the fitted actuator.")
@click.option("--json", "json_path", type=_OUT, help="JSON file for the result.")
@click.option("--plot", type=_OUT, help="Picture of data, fit and residuals (.png, .pdf, .svg).")
@click.option("--report", type=_OUT, help="One HTML file with all of it.")
def identify(data: tuple[Path, ...], actuator: str | None, electrode_resistance: str | None, **options: Any) -> None:
    """Fit a strip to a measured step, waveform or impedance spectrum.

    DATA is a CSV file with a name and a unit in every header: time_s, voltage_V, current_mA, displacement_mm; or a
    spectrum: frequency_Hz, re_ohm, im_ohm, or what EC-Lab (text), Gamry (.DTA) and ZPlot (.z) export. Several files of
    one strip, records and spectra, are fitted together, and each is predicted from the others.
    """
    from ..files import require_writable
    from ..identify import identify as fit
    from ..identify import read_measurement
    from ..identify.report import plot_identification, table, write_actuator, write_json
    from ..measurements.spectrum_files import is_spectrum
    from ..report.plots import require_picture
    from ..strip.file import load_actuator
    from .identify_records import identify_together
    from .identify_spectrum import identify_file

    outputs = [options[k] for k in ("out", "json_path", "plot", "report") if options[k]]
    if len({p.resolve() for p in (*data, *outputs)}) < len(data) + len(outputs):
        raise InputError("two of DATA, --out, --json, --plot and --report name the same file; give each its own")
    for path in (options["out"], options["json_path"], options["report"]):
        if path:
            require_writable(path)
    if options["plot"]:
        require_picture(options["plot"])
    base = load_actuator(actuator) if actuator else None
    if len(data) > 1:
        if options["intervals"] != "covariance":
            raise InputError("--intervals is for one file; several together have the covariance's")
        free = electrode_resistance == "fit"
        identify_together(data, base, "fit" if free else resistance(electrode_resistance), options)
        return
    for name in ("own", "bias"):
        if options[name]:
            raise InputError(f"--{name} is for several files fitted together, and there is one")
    held = resistance(electrode_resistance)
    if is_spectrum(data[0]):
        chosen = {k: options[k] for k in ("intervals", "out", "json_path", "plot", "report")}
        identify_file(data[0], base, held, options["model"], **chosen)
        return
    measurement = read_measurement(data[0])
    with evaluation_counter() as advance:
        result = fit(
            measurement,
            base=base,
            model=options["model"],
            electrode_resistance=held,
            engine=options["engine"],
            intervals=options["intervals"],
            progress=advance,
        )
    if options["out"]:
        write_actuator(result, options["out"])
    if options["json_path"]:
        write_json(result, options["json_path"])
    if options["plot"]:
        plot_identification(result, options["plot"])
    if options["report"]:
        from ..identify.html_report import write_report

        write_report(result, options["report"], command_line())
    click.echo(table(result))
    for line in result.warnings:
        click.echo(f"warning: {line}", err=True)


def resistance(text: str | None) -> float | None:
    """What --electrode-resistance was given, in ohm."""
    from ..units import parse

    if text == "fit":
        raise InputError("--electrode-resistance fit needs several files of different voltages and a nonlinear model")
    return parse(text, "ohm", "--electrode-resistance") if text else None
