"""The command ``identify``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import click

from ..errors import InputError
from .emit import emit, require_outputs
from .options import ModelOption, engine_option, output_options, outputs
from .progress import ProgressBar


@click.command()
@click.argument("data", type=click.Path(path_type=Path), nargs=-1, required=True)
@click.option("--actuator", help="The strip that was measured: its sizes, E, electrodes. TOML file or preset.")
@click.option("--model", cls=ModelOption, default="auto", show_default=True)
@click.option("--electrode-resistance", help="Held, such as 2ohm; fit: nonlinear models.  [default: the actuator's]")
@click.option("--own", multiple=True, help="A parameter that each of several files has for itself; may be repeated.")
@click.option("--bias", multiple=True, help="Of spectra: 1V, or FILE=1V for one of them.")
@engine_option
@click.option(
    "--intervals",
    type=click.Choice(["covariance", "bootstrap", "profile", "mcmc", "autoregression"]),
    default="covariance",
    show_default=True,
    help="How 95 % intervals are made; covariance: by an autoregression where residuals are autocorrelated.",
)
@output_options("TOML file for the fitted actuator.", "Picture of data, fit and residuals (.png, .pdf, .svg).")
@click.pass_context
def identify(context: click.Context, /, data: tuple[Path, ...], actuator: str | None, **options: Any) -> None:
    """Fit a strip to measured steps, waveforms and impedance spectra.

    DATA is a CSV file with a name and a unit in every header: time_s, voltage_V, current_mA, displacement_mm; or a
    spectrum: frequency_Hz, re_ohm, im_ohm, or what EC-Lab (text), Gamry (.DTA) and ZPlot (.z) export. Several files of
    one strip, records and spectra, are fitted together, and each is predicted from the others.
    """
    from ..identify import identify as fit
    from ..measurements.read import read
    from ..measurements.spectrum import Spectrum
    from ..report.identification import write_actuator
    from ..strip.file import load_actuator

    require_outputs(outputs(options), {"DATA": data})
    base = load_actuator(actuator) if actuator else None
    given = options["electrode_resistance"]
    files = [read(path) for path in data]
    spectra = [isinstance(file, Spectrum) for file in files]
    bias = biases(data, spectra, options["bias"])
    if all(spectra) and context.get_parameter_source("engine") is click.core.ParameterSource.COMMANDLINE:
        click.echo("warning: spectra are fitted by their closed form: --engine has no effect on them", err=True)
    with ProgressBar("evaluation", doing="fitting") as bar:
        result = fit(
            files,
            base=base,
            model=options["model"],
            electrode_resistance=resistance(given),
            own=options["own"],
            bias=bias,
            engine=options["engine"],
            intervals=options["intervals"],
            progress=bar.count,
        )
    emit(result, outputs(options), inputs=(*data, actuator), seed=result.seed, writers={"--out": write_actuator})


def resistance(text: str | None) -> float | Literal["fit"] | None:
    """Return what --electrode-resistance was given, in ohm."""
    from ..units import parse

    if text == "fit":
        return "fit"
    return parse(text, "ohm", "--electrode-resistance") if text else None


def biases(paths: Sequence[Path], spectra: Sequence[bool], given: Sequence[str]) -> list[float]:
    """Return the bias [V] of every file from what ``--bias`` was given: VOLTAGE for all spectra, or FILE=VOLTAGE."""
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
