"""What ``identify`` does with a file that holds an impedance spectrum."""

from __future__ import annotations

from pathlib import Path

import click

from ..provenance import command_line
from ..strip.actuator import Actuator
from .progress import ProgressBar


def identify_file(
    data: Path,
    base: Actuator | None,
    held: float | None,
    model: str,
    *,
    intervals: str,
    out: Path | None,
    json_path: Path | None,
    plot: Path | None,
    report: Path | None,
) -> None:
    """Fit the spectrum in ``data``, write what was asked for, print the table; Re ``held`` [ohm]."""
    from ..identify.spectrum_identification import identify_spectrum
    from ..identify.spectrum_report import plot_spectrum, spectrum_table, write_spectrum_actuator, write_spectrum_json
    from ..measurements.spectrum_files import read_spectrum

    spectrum = read_spectrum(data)
    with ProgressBar("evaluation", doing="fitting") as bar:
        result = identify_spectrum(
            spectrum, base=base, model=model, electrode_resistance=held, intervals=intervals, progress=bar.count
        )
    if out:
        write_spectrum_actuator(result, out)
    if json_path:
        write_spectrum_json(result, json_path)
    if plot:
        plot_spectrum(result, plot)
    if report:
        from ..identify.html_report import write_report

        write_report(result, report, command_line())
    click.echo(spectrum_table(result))
    for line in result.warnings:
        click.echo(f"warning: {line}", err=True)
