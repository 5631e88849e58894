"""The command ``identify`` for several records and spectra of one strip."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import click

from ..errors import InputError
from ..provenance import command_line
from ..strip.actuator import Actuator
from .progress import ProgressBar


def identify_together(
    paths: tuple[Path, ...],
    base: Actuator | None,
    electrode_resistance: float | Literal["fit"] | None,
    options: dict[str, Any],
) -> None:
    """Fit the files at ``paths`` jointly; ``options`` are those of the command."""
    from .. import __version__
    from ..files import write_text
    from ..identify import read_measurement, read_spectrum
    from ..identify.joint import fit_jointly
    from ..identify.joint_report import files, joint_table, plot_joint
    from ..measurements.spectrum_files import is_spectrum
    from ..strip.file import save_actuator

    spectra = [is_spectrum(path) for path in paths]
    bias = biases(paths, spectra, options["bias"])
    measurements = [
        read_spectrum(path) if spectrum else read_measurement(path)
        for path, spectrum in zip(paths, spectra, strict=True)
    ]
    with ProgressBar("evaluation", doing="fitting") as bar:
        result = fit_jointly(
            measurements,
            model=options["model"],
            base=base,
            electrode_resistance=electrode_resistance,
            own=options["own"],
            bias=bias,
            engine=options["engine"],
            progress=bar.count,
        )
    if options["out"]:
        names = ", ".join(dict.fromkeys(r.source for r in result.records))
        comment = f"fitted by ilg_circuit {__version__} to {files(result)} ({names}), model {result.model}"
        save_actuator(
            result.actuator, options["out"], "\n".join([comment, *(f"warning: {w}" for w in result.warnings)])
        )
    if options["json_path"]:
        write_text(options["json_path"], json.dumps(result.to_json(), indent=2, allow_nan=False) + "\n")
    if options["plot"]:
        plot_joint(result, options["plot"])
    if options["report"]:
        from ..identify.html_report import write_report

        write_report(result, options["report"], command_line())
    click.echo(joint_table(result))
    for line in result.warnings:
        click.echo(f"warning: {line}", err=True)


def biases(paths: Sequence[Path], spectra: Sequence[bool], given: Sequence[str]) -> list[float]:
    """Bias [V] of every file from what ``--bias`` was given: VOLTAGE for all spectra, or FILE=VOLTAGE for one."""
    from ..units import parse

    found = [0.0] * len(paths)
    for text in sorted(given, key=lambda t: "=" in t):
        name, _, voltage = text.rpartition("=")
        chosen = [k for k, path in enumerate(paths) if spectra[k] and (not name or name in (str(path), path.name))]
        if not chosen:
            what = f"'{name}' is not one of them" if name else "there is none"
            raise InputError(f"--bias {text}: it is for the spectra among the files, and {what}")
        for k in chosen:
            found[k] = parse(voltage, "V", "--bias")
    return found
