"""The command ``identify``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

import click

from ..errors import InputError
from ..units import parse
from .emit import emit, say
from .options import (
    ModelOption,
    displacement_options,
    engine_option,
    filmed,
    output_options,
    outputs,
    reading_options,
    said,
)
from .paths import FILE, STRIP, LongCommand, force_option
from .progress import ProgressBar


@click.command(cls=LongCommand)
@click.argument("data", type=FILE, nargs=-1, required=True)
@click.option("--actuator", help="The strip that was measured: its sizes, E, electrodes. TOML file or preset.")
@click.option("--model", cls=ModelOption, default="auto")
@click.option("--electrode-resistance", help="Held, such as 2ohm; fit: nonlinear models.  [default: the actuator's]")
@click.option("--own", multiple=True, help="A parameter that each of several files has for itself; may be repeated.")
@click.option("--bias", multiple=True, help="Of spectra: 1V, or FILE=1V for one of them.")
@click.option("--onset", multiple=True, help="When the voltage began: 4s, last-rest or first-level; or FILE=4s.")
@displacement_options
@reading_options
@click.option("--until", help="Fit records up to this time after the onset, such as 16s.  [default: all]")
@engine_option
@click.option(
    "--intervals",
    type=click.Choice(["covariance", "bootstrap", "profile", "mcmc", "autoregression"]),
    default="covariance",
    help="How 95 % intervals are made; covariance: by an autoregression where residuals are autocorrelated.",
)
@output_options("TOML file for the fitted actuator.", "Picture of data, fit and residuals (.png, .pdf, .svg).", STRIP)
@force_option
@click.pass_context
def identify(context: click.Context, /, data: tuple[Path, ...], actuator: str | None, **options: Any) -> None:
    """Fit a strip to measured steps, waveforms and impedance spectra.

    DATA is a CSV file with a name and a unit in every header: time_s, voltage_V, current_mA, displacement_mm; or a
    spectrum: frequency_Hz, re_ohm, im_ohm; or a file of an instrument. What its headers do not tell, --columns and
    --units do. Several files of one strip, records and spectra, are fitted together, and each is predicted from the
    others.
    """
    from ..identification import identify as fit
    from ..measurements.read import read
    from ..measurements.spectrum import Spectrum
    from ..report.identification import write_actuator
    from ..strip.file import load_actuator

    written = outputs(options)
    base = load_actuator(actuator) if actuator else None
    begun = onsets(data, options.pop("onset"))
    meant = said(options)
    films = options["displacement"]
    files = [read(path, onset=begun[k], said=meant.of_data if films else meant) for k, path in enumerate(data)]
    files = filmed(files, options, meant)
    spectra = [isinstance(file, Spectrum) for file in files]
    options["bias"] = biases(data, spectra, options["bias"])
    if all(spectra) and context.get_parameter_source("engine") is click.core.ParameterSource.COMMANDLINE:
        say("warning: spectra are fitted by their closed form: --engine has no effect on them", err=True)
    options["electrode_resistance"] = resistance(options["electrode_resistance"])
    options["until"] = parse(options["until"], "s", "--until") if options["until"] else None
    late = options["displacement_delay"]
    options["displacement_delay"] = late if late in (None, "fit") else parse(late, "s", "--displacement-delay")
    with ProgressBar("evaluation", doing="fitting") as bar:
        result = fit(files, base=base, progress=bar.count, **options)
    emit(result, written, inputs=(*data, *films, actuator), seed=result.seed, writers={"--out": write_actuator})
    if not result.success:
        context.exit(1)


def resistance(text: str | None) -> float | Literal["fit"] | None:
    """Return what --electrode-resistance was given, in ohm."""
    if text == "fit":
        return "fit"
    return parse(text, "ohm", "--electrode-resistance") if text else None


def biases(paths: Sequence[Path], spectra: Sequence[bool], given: Sequence[str]) -> list[float]:
    """Return the bias [V] of every file from what ``--bias`` was given: VOLTAGE for all spectra, or FILE=VOLTAGE."""
    found = [0.0] * len(paths)
    chosen = [k for k, yes in enumerate(spectra) if yes]
    for k, voltage in each_file(paths, chosen, given, "--bias", "the spectra among the files"):
        found[k] = parse(voltage, "V", "--bias")
    return found


def onsets(paths: Sequence[Path], given: Sequence[str]) -> list[Any]:
    """Return what ``--onset`` says of every file: a time [s], the name of a reading, or None."""
    found: list[Any] = [None] * len(paths)
    for k, text in each_file(paths, range(len(paths)), given, "--onset", "the files"):
        words = text.replace("-", "").isalpha()
        if words and text not in ("last-rest", "first-level"):
            raise InputError(f"--onset {text}: write a time such as 4s, or last-rest or first-level")
        found[k] = text if words else parse(text, "s", "--onset")
    return found


def each_file(
    paths: Sequence[Path], among: Sequence[int], given: Sequence[str], option: str, what: str
) -> Iterator[tuple[int, str]]:
    """Yield the index of a file and the value for it, for every VALUE and FILE=VALUE that an option was given.

    Values for one file come last. Raises InputError for a file that is not ``among`` those the option is for.
    """
    for text in sorted(given, key=lambda t: "=" in t):
        name, _, value = text.rpartition("=")
        chosen = [k for k in among if not name or name in (str(paths[k]), paths[k].name)]
        if not chosen:
            reason = f"'{name}' is not one of them" if name else "there is none"
            raise InputError(f"{option} {text}: it is for {what}, and {reason}")
        for k in chosen:
            yield k, value
