"""The command ``identify``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..files import outdated_by_failure
from ..front.each_file import by_file
from ..front.films import by_file as drives_by_file
from ..result import Result
from .completing import strips
from .each import fit_each
from .emit import emit, say
from .help import argument, group
from .options import displacement_options, fit_options, output_options, outputs, reading_options, sizes, strip_options
from .paths import FILE, FOLDER, LOG, PARAMETERS, STRIP, LongCommand, forced, forcing
from .progress import ProgressBar

#: Options that go with --shape and with --sheets, and those that go with either alone.
_OF_BOTH = ("actuator", "columns", "units", "json", "plot", "report", "size", "style", "time_limit")
_OF_MARKS = (*_OF_BOTH, "scale")
_OF_SHEETS = (*_OF_BOTH, "part", "width", "model", "electrode_resistance")
_OF_SENSING = (*_OF_BOTH, "out", "part", "cycle")
_ALONE = {
    "--shape": ("frequency", "places"),
    "--sheets": ("lengths", "contact", "contact_length"),
    "--sensing": ("terminals",),
}


@click.command(
    cls=LongCommand,
    examples=(
        "identify step.csv --length 35mm --free-length 30mm --width 5mm --thickness 0.5mm",
        "identify current.csv --displacement camera.csv --scale 0.042mm/px --actuator strip.toml --out fitted.toml",
        "identify camera.csv --drive step:2V --scale 0.042mm/px --actuator strip.toml",
        "identify --shape marks.csv --actuator fitted.toml --frequency 0.1Hz",
        "identify eis_20mm.csv eis_35mm.csv --sheets --lengths 20mm,35mm --width 5mm",
        "identify moved.csv --sensing --actuator fitted.toml --out sensor.toml",
        "identify monday.csv tuesday.csv --each --actuator strip.toml --table all.csv",
    ),
)
@group("Input", argument("data", "Files of measurements.", type=FILE, nargs=-1, required=True))
@group(
    "Strip",
    click.option(
        "--actuator",
        shell_complete=strips,
        metavar="STRIP",
        help="The strip that was measured: its sizes, E, electrodes. TOML file or preset.",
    ),
)
@strip_options(required=False)
@fit_options
@group(
    "Model",
    click.option(
        "--own",
        multiple=True,
        metavar="NAME",
        help="A parameter that each file is given its own value of (others are shared by all files); may be repeated.",
    ),
    click.option("--bias", multiple=True, metavar="VOLTAGE", help="Bias voltage of spectra: 1V, or FILE=1V for one."),
    click.option(
        "--onset",
        multiple=True,
        metavar="TIME",
        help="When the voltage began: 4s, last-rest or first-level; or FILE=4s.",
    ),
    click.option(
        "--intervals",
        type=click.Choice(["covariance", "bootstrap", "profile", "mcmc", "autoregression"]),
        default="covariance",
        help="How 95 % intervals are made; covariance: by an autoregression where residuals are autocorrelated.",
    ),
)
@displacement_options
@group(
    "Displacement",
    click.option(
        "--coupling",
        type=click.Choice(["auto", "ec31", "charge1", "charge2", "voltage1", "voltage2", "voltage3", "fractional"]),
        default="auto",
        help="Law of bending: d(s), or relaxations of charge or voltage; auto: by BIC and prediction.",
    ),
    click.option(
        "--drive",
        multiple=True,
        metavar="DRIVE",
        help="The voltage under which DATA was filmed that holds a displacement alone: step:2V, file:drive.csv, or any "
        "other form of simulate; or FILE=step:2V.",
    ),
)
@reading_options
@output_options("TOML file for the fitted actuator.", "Picture of data, fit and residuals (.png, .pdf, .svg).", STRIP)
@group(
    "Output",
    click.option("--table", type=PARAMETERS, help="Table of the parameters (.tex, .csv, .md)."),
    click.option(
        "--folder", type=FOLDER, help="Folder for all results.  [default: step.fit/, if none of the above is given]"
    ),
    click.option("-v", "--verbose", is_flag=True, help="Print everything."),
)
@forcing("Let --out replace the file of the actuator, and --folder any folder.")
@group(
    "Many files",
    click.option("--each", is_flag=True, help="Fit every file individually: one table, and a folder for each file."),
    click.option("--jobs", type=int, metavar="N", help="With --each: number of processes.  [default: one a core]"),
    click.option("--log", type=LOG, help="With --each: file to which one line per file is appended."),
)
@group(
    "Shape",
    click.option(
        "--shape",
        is_flag=True,
        help="DATA are tracks of marks along the strip (time_s, x_mm, y_mm, a file a mark; or x1_mm, y1_mm, x2_mm, "
        "...): find the resistance along its electrodes.",
    ),
    click.option(
        "--frequency",
        metavar="FREQUENCY",
        help="With --shape: that of the sine under which the strip moves.  [default: at rest at the end]",
    ),
    click.option(
        "--places",
        metavar="LENGTHS",
        help="With --shape: the marks' distances from the clamp.  [default: each x at rest]",
    ),
)
@group(
    "Sheets",
    click.option(
        "--sheets",
        is_flag=True,
        help="DATA are impedance spectra of one length of the strip, or of several: find the resistance along its "
        "electrodes.",
    ),
    click.option(
        "--lengths",
        metavar="LENGTHS",
        help="With --sheets: length of the strip in each, such as 20mm,35mm.  [default: the strip's]",
    ),
    click.option(
        "--contact",
        type=click.Choice(["end", "both"]),
        default="end",
        help="With --sheets: a contact at one end of the length, or at both.",
    ),
    click.option(
        "--contact-length",
        metavar="LENGTH",
        default="0mm",
        help="With --sheets: length of strip under each contact, beyond --lengths.",
    ),
)
@group(
    "Sensing",
    click.option(
        "--sensing",
        is_flag=True,
        help="DATA are records of a moved tip (time_s, displacement_mm, and voltage_mV or current_uA): find the law by "
        "which the strip senses.",
    ),
    click.option(
        "--terminals",
        type=click.Choice(["open", "short"]),
        help="With --sensing: take the voltage (open) or the current (short).  [default: the one that DATA have]",
    ),
)
@click.pass_context
def identify(
    context: click.Context,
    /,
    data: tuple[Path, ...],
    each: bool,
    shape: bool,
    sheets: bool,
    sensing: bool,
    **options: Any,
) -> None:
    """Fit a strip to measured steps, waveforms and impedance spectra.

    DATA is a CSV file with a name and a unit in every header: time_s, voltage_V, current_mA, displacement_mm; or a
    spectrum: frequency_Hz, re_ohm, im_ohm; or a file of an instrument. --columns and --units supply what its headers do
    not say. Several files of one strip, records and spectra, are fitted together, and each is predicted from the
    others.

    Without --out, --json, --plot, --report or --table a folder with all results, step.fit/, is written beside the
    data.
    """
    modes = [f"--{name}" for name, there in (("shape", shape), ("sheets", sheets), ("sensing", sensing)) if there]
    if len(modes) > 1:
        raise InputError(
            "--shape is for tracks of marks, --sheets for spectra, --sensing for moved tips: give one of them"
        )
    chosen = modes[0] if modes else ""
    alone = {name: (mode, options.pop(name)) for mode, names in _ALONE.items() for name in names}
    for name, (mode, _) in alone.items():
        if mode != chosen and given(context, name):
            raise InputError(f"--{name.replace('_', '-')} goes with {mode}")
    if chosen:
        own = {name: value for name, (mode, value) in alone.items() if mode == chosen}
        (fit_marks if shape else fit_sheets if sheets else fit_sensing)(context, data, options, own)
        return
    options |= sizes(options)
    for name in ("bias", "onset"):
        options[name] = by_file(options[name]) or None
    options["drive"] = drives_by_file(options["drive"]) or None
    if each:
        fit_each(context, data, options)
        return
    if left := [name for name in ("jobs", "log") if options.pop(name)]:
        raise InputError(f"--{left[0]} goes with --each, which fits every file individually")
    fit_together(context, data, options)


def fit_marks(context: click.Context, data: tuple[Path, ...], options: dict[str, Any], own: dict[str, Any]) -> None:
    """Fit the resistance along the electrodes to the shape that marks show."""
    from ..front.shapes import identify_shape

    require_none_else(context, options, _OF_MARKS, "--shape")
    if options["actuator"] is None:
        raise InputError("--shape needs the strip: --actuator, with its sizes and the circuit of its terminals")
    how = {name: options[name] for name in ("scale", "columns", "units")}
    finish(identify_shape(list(data), options["actuator"], **own, **how), data, options)


def fit_sheets(context: click.Context, data: tuple[Path, ...], options: dict[str, Any], own: dict[str, Any]) -> None:
    """Fit the resistance along the electrodes to impedance spectra."""
    from ..front.sheets import identify_sheets

    require_none_else(context, options, _OF_SHEETS, "--sheets")
    how = {name: options[name] for name in ("width", "model", "columns", "units", "part")}
    if options["electrode_resistance"] is not None:
        how["electrode_resistance"] = options["electrode_resistance"]
    finish(identify_sheets(list(data), strip=options["actuator"], **own, **how), data, options)


def fit_sensing(context: click.Context, data: tuple[Path, ...], options: dict[str, Any], own: dict[str, Any]) -> None:
    """Fit the law of sensing to records of a moved tip."""
    from ..front.sensing import identify_sensing

    require_none_else(context, options, _OF_SENSING, "--sensing")
    if options["actuator"] is None:
        raise InputError("--sensing needs the strip: --actuator, with its sizes and its circuit")
    how = {name: options[name] for name in ("columns", "units", "part", "cycle")}
    result = identify_sensing(list(data), options["actuator"], **own, **how)
    inputs = (*data, options["actuator"])
    written = outputs(options)
    if not result.success:
        written["--out"] = None
    emit(result, written, inputs=inputs, writers={"--out": lambda made, path: made.write_strip(path)})
    if not result.success:
        context.exit(1)


def require_none_else(context: click.Context, options: dict[str, Any], allowed: tuple[str, ...], mode: str) -> None:
    """Raise InputError for an option on the command line that does not go with a ``mode``."""
    others = [p for p in context.command.params if p.name in options and p.name not in allowed]
    if wrong := next((p for p in others if p.name and given(context, p.name)), None):
        raise InputError(f"{wrong.opts[-1]} does not go with {mode}")


def finish(result: Result, data: tuple[Path, ...], options: dict[str, Any]) -> None:
    """Show and write a resistance along the electrodes, which is no strip."""
    written = {name: path for name, path in outputs(options).items() if name != "--out"}
    emit(result, written, inputs=(*data, options["actuator"]))


def fit_together(context: click.Context, data: tuple[Path, ...], options: dict[str, Any]) -> None:
    """Fit all files as those of one strip."""
    from ..front.fits import identify as fit
    from ..report.folder import folder_beside, require_own, save_folder, short_text
    from ..report.identification import write_actuator
    from ..report.parameter_table import write_table

    verbose, actuator, force = options.pop("verbose"), options.pop("actuator"), forced(context)
    written = outputs(options) | {"--table": options.pop("table"), "--folder": options.pop("folder")}
    note = ""
    if not any(written.values()):
        written["--folder"], note = folder_beside(data)
    folder = written["--folder"]
    if folder is not None:
        require_own(folder, data, force=force)
    films = options["displacement"] = list(options["displacement"]) or None
    with ProgressBar("evaluation", doing="fitting") as bar, outdated_by_failure(folder):
        result = fit(list(data), actuator, progress=bar.count, **options)
    if all(d.quantity == "impedance" for d in result.data) and given(context, "engine"):
        say("warning: spectra are fitted by their closed form: --engine has no effect on them", err=True)
    text, told = short_text(result, folder, note) if folder is not None and not verbose else (None, None)
    emit(
        result,
        written,
        inputs=(*data, *(films or ()), actuator),
        seed=result.seed,
        writers={
            "--out": write_actuator,
            "--table": write_table,
            "--folder": lambda made, path: save_folder(made, path, force=force),
        },
        text=text,
        warnings=told,
    )
    if not result.success:
        context.exit(1)


def given(context: click.Context, option: str) -> bool:
    """Return True for an option that stands on the command line."""
    return context.get_parameter_source(option) is click.core.ParameterSource.COMMANDLINE
