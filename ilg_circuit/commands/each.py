"""``identify --each``: many files, each fitted individually."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from .emit import emit, origin
from .options import outputs
from .paths import forced
from .progress import ProgressBar


def fit_each(context: click.Context, data: tuple[Path, ...], options: dict[str, Any]) -> None:
    """Fit every file individually, and end with the exit code of the worst."""
    from ..front.each import TABLE, folder_of_all, identify_each
    from ..report.parameter_table import write_table

    if options.pop("own"):
        raise InputError("--own is for files that are fitted together; with --each all parameters are a file's own")
    if options.pop("displacement"):
        raise InputError("--displacement is for files that are fitted together, not for --each")
    verbose = options.pop("verbose")
    written = outputs(options) | {"--table": options.pop("table")}
    if written.pop("--out"):
        raise InputError("--out is for one fit; with --each every file has its own fitted.toml in --folder")
    actuator, folder = options.pop("actuator"), options.pop("folder") or folder_of_all(data)
    batch = identify_each(
        data,
        actuator,
        folder=folder,
        jobs=options.pop("jobs"),
        log=options.pop("log"),
        progress=ProgressBar("file", doing="fitting"),
        call=origin().call,
        force=forced(context),
        **options,
    )
    text = f"{batch.summary()}\n{folder}/: {TABLE}, and a folder a file"
    told = [f"{file.path}: {line}" for file in batch for line in file.warnings] if verbose else []
    emit(batch, written, inputs=(*data, actuator), writers={"--table": write_table}, text=text, warnings=told)
    context.exit(batch.exit_code)
