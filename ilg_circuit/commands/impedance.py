"""The command ``impedance``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .options import beam_of, beam_option

_OUT = click.Path(path_type=Path)


@click.command()
@click.argument("actuator")
@click.option("--from", "low", default="1mHz", show_default=True, help="Lowest frequency.")
@click.option("--to", "high", default="10kHz", show_default=True, help="Highest frequency.")
@click.option("--points", type=int, help="Number of frequencies, even in logarithm.  [default: ten a decade]")
@click.option("--bias", default="0V", show_default=True, help="Voltage about which the signal is small.")
@click.option("--tip", type=click.Choice(["free", "clamped"]), default="free", show_default=True)
@beam_option
@click.option("--load", "load_text", help="What hangs on the tip, as for simulate.")
@click.option("--engine", type=click.Choice(["ngspice", "exact"]), default="ngspice", show_default=True)
@click.option("--check", is_flag=True, help="Compare with the other engine and the closed form.")
@click.option("--out", type=_OUT, help="CSV file to write: frequency_Hz, re_ohm, im_ohm.")
@click.option("--plot", type=_OUT, help="Bode and Nyquist plot to write (.png, .pdf, .svg).")
def impedance(actuator: str, low: str, high: str, load_text: str | None, **options: Any) -> None:
    """The small-signal spectrum at the strip's terminals, by AC analysis about a bias voltage."""
    from ..circuit.strip import parse_load
    from ..files import require_writable
    from ..report.plots import plot_impedance, require_picture
    from ..simulation.impedance import frequencies
    from ..simulation.impedance import impedance as solve
    from ..strip.file import load_actuator
    from ..units import parse

    strip = load_actuator(actuator)
    f = frequencies(parse(low, "Hz", "--from"), parse(high, "Hz", "--to"), options["points"])
    if options["out"]:
        require_writable(options["out"])
    if options["plot"]:
        require_picture(options["plot"])
    load = parse_load(load_text)
    how = {
        "bias": parse(options["bias"], "V", "--bias"),
        "tip": options["tip"],
        "beam": beam_of(strip, options["beam"], load),
        "load": load,
    }
    found = solve(strip, f, engine=options["engine"], **how)
    if options["out"]:
        found.write_csv(options["out"])
    if options["plot"]:
        plot_impedance(found, options["plot"])
    click.echo(f"{strip.name}: {len(f)} frequencies about {how['bias']:g} V")
    click.echo(found.summary())
    for line in found.warnings():
        click.echo(f"warning: {line}", err=True)
    if options["check"]:
        from ..simulation.check import check_impedance, report, require_agreement

        differences = check_impedance(found, **how)
        click.echo(report(differences))
        require_agreement(differences)
