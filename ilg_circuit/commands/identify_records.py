"""The command ``identify`` for several records of one strip."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from ..actuator import Actuator
from ..errors import InputError
from .command_line import command_line
from .progress import evaluation_counter


def identify_together(
    paths: tuple[Path, ...], base: Actuator | None, electrode_resistance: float | None, options: dict[str, Any]
) -> None:
    """Fit the records at ``paths`` jointly; ``options`` are those of the command."""
    from ..actuator_file import save_actuator
    from ..files import write_text
    from ..identify import read_measurement
    from ..identify.joint import fit_jointly
    from ..plots import plot_joint

    if options["model"] == "auto":
        raise InputError(
            "several files are fitted with one model: name it, as in --model rc2 (identify one file to see which)"
        )
    measurements = [read_measurement(path) for path in paths]
    with evaluation_counter() as advance:
        result = fit_jointly(
            measurements,
            model=options["model"],
            base=base,
            electrode_resistance=electrode_resistance,
            engine=options["engine"],
            progress=advance,
        )
    if options["out"]:
        comment = f"fitted to {', '.join(r.source for r in result.records)}, model {result.model}"
        save_actuator(
            result.actuator, options["out"], "\n".join([comment, *(f"warning: {w}" for w in result.warnings)])
        )
    if options["json_path"]:
        write_text(options["json_path"], json.dumps(result.to_json(), indent=2) + "\n")
    if options["plot"]:
        plot_joint(result, options["plot"])
    if options["report"]:
        from ..identify.html_report import write_report

        write_report(result, options["report"], command_line())
    click.echo(result.table())
    for line in result.warnings:
        click.echo(f"warning: {line}", err=True)
