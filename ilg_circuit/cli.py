"""The command line. Exit codes: 0 done, 2 the input is wrong, 1 the solve failed; errors are one line."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import __version__
from .cli_arm import arm
from .cli_cpg import cpg
from .cli_impedance import impedance
from .cli_ogden import ogden
from .cli_sense import sense
from .errors import IlgError, InputError

if TYPE_CHECKING:
    from .solve.transient import Progress

_ACTUATOR = click.argument("actuator")
_OUT = click.Path(path_type=Path)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="ilg-circuit")
def cli() -> None:
    """Ionic-liquid-gel strips as circuits: simulate them, fit them to measurements, hand out netlists.

    ACTUATOR is a TOML file or a preset (paper). Quantities carry units: --drive step:4V --duration 300s.
    """


for command in (impedance, sense, ogden, cpg, arm):
    cli.add_command(command)


def main(arguments: list[str] | None = None) -> None:
    """Entry point: every failure that is ours ends in one line on stderr and the exit code."""
    try:
        status = cli.main(args=arguments, prog_name="ilg-circuit", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:  # called without a command: the help is the answer
        click.echo(error.format_message())
        sys.exit(2)
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except click.Abort:
        _fail("interrupted", 1)
    except IlgError as error:
        _fail(str(error), error.exit_code)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of a pipe has gone; nothing is wrong here
        sys.exit(0)
    except MemoryError:
        _fail("not enough memory for this many samples; ask for fewer", 1)
    sys.exit(status if isinstance(status, int) else 0)


def _fail(message: str, status: int) -> None:
    click.echo("ilg-circuit: " + " ".join(message.split()), err=True)
    sys.exit(status)


@cli.command()
@_ACTUATOR
@click.option("--from", "low", default="0.1mHz", show_default=True, help="Low end of the band of use.")
@click.option("--to", "high", default="10Hz", show_default=True, help="High end of the band of use.")
@click.option("--voltage", help="Largest voltage, for the electrochemical window and the deflection.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def show(actuator: str, low: str, high: str, voltage: str | None, as_json: bool) -> None:
    """Geometry, lumped elements, and where the model holds."""
    from .actuator_file import load_actuator
    from .show import describe, tabulate
    from .units import parse

    band = (parse(low, "Hz", "--from"), parse(high, "Hz", "--to"))
    if not 0 < band[0] < band[1]:
        raise InputError(f"band from {low} to {high}: give two frequencies above zero, the lower one first")
    volts = abs(parse(voltage, "V", "--voltage")) if voltage else None
    description = describe(load_actuator(actuator), band=band, voltage=volts)
    click.echo(json.dumps(description, indent=2) if as_json else tabulate(description))


@cli.command()
@_ACTUATOR
@click.option("--drive", required=True, help="step:4V, square:4V,30s[,duty], sine:2V,0.1Hz, ramp:1V/s, file:drive.csv")
@click.option("--duration", required=True, help="How long, such as 300s.")
@click.option("--tip", type=click.Choice(["free", "clamped"]), default="free", show_default=True)
@click.option("--beam", type=click.Choice(["dynamic", "static"]), default="dynamic", show_default=True)
@click.option("--load", "load_text", help="mass=1g,stiffness=1mN/m,damping=1uN*s/m: what hangs on the tip.")
@click.option("--engine", type=click.Choice(["ngspice", "exact"]), default="ngspice", show_default=True)
@click.option(
    "--accuracy",
    type=float,
    help="Error allowed, relative to each maximum.  [default: 1e-09; with nonlinear elements 1e-06]",
)
@click.option("--samples", type=int, help="Number of samples.  [default: 601]")
@click.option("--step", help="Time between samples, such as 0.1s; instead of --samples.")
@click.option("--check", is_flag=True, help="Compare with the exact solver and the closed forms.")
@click.option("--out", type=_OUT, help="CSV file to write.")
@click.option("--band", is_flag=True, help="Standard errors from the fit that the actuator comes from.")
@click.option("--with-energy", is_flag=True, help="Add a column energy_J to the CSV.")
@click.option("--plot", type=_OUT, help="Picture to write (.png, .pdf, .svg).")
def simulate(actuator: str, drive: str, duration: str, load_text: str | None, step: str | None, **options: Any) -> None:
    """Drive a strip and write its current, displacement, force and charge over time."""
    from .actuator_file import load_actuator
    from .check import check, report, require_agreement
    from .circuit.drive import parse_drive
    from .circuit.strip import parse_load
    from .files import require_writable
    from .plots import plot_response, require_picture
    from .response import sample_times
    from .response import simulate as solve
    from .units import parse

    strip = load_actuator(actuator)
    seconds = parse(duration, "s", "--duration")
    times = sample_times(seconds, samples=options["samples"], step=parse(step, "s", "--step") if step else None)
    source = parse_drive(drive, seconds)
    how = {"tip": options["tip"], "beam": options["beam"], "load": parse_load(load_text)}
    if options["out"]:
        require_writable(options["out"])
    if options["plot"]:
        require_picture(options["plot"])
    how_solved = {"engine": options["engine"], "accuracy": options["accuracy"], "progress": _progress()}
    response = solve(strip, source, times, **how_solved, **how)
    stderr = None
    if options["band"]:
        from .prediction import prediction_band

        stderr = prediction_band(strip, source, response.time, engine=options["engine"], **how).stderr
    if options["out"]:
        response.write_csv(options["out"], energy=options["with_energy"], stderr=stderr)
    if options["plot"]:
        plot_response(response, options["plot"], stderr)
    click.echo(f"{response.netlist.title}: {source.text}, {seconds:g} s, {len(times)} samples")
    click.echo(response.summary())
    click.echo(response.account.summary())
    if response.engine == "ngspice":
        click.echo(f"solved by ngspice, estimated error {response.error:.1e} of each maximum")
    for line in response.warnings:
        click.echo(f"warning: {line}", err=True)
    if options["check"]:
        differences = check(response, **how)
        click.echo(report(differences))
        require_agreement(differences)


@cli.command()
@_ACTUATOR
@click.option("--drive", default="step:4V", show_default=True, help="Drive of a .cir deck, as for simulate.")
@click.option("--duration", default="300s", show_default=True, help="Duration of a .cir deck.")
@click.option("--tip", type=click.Choice(["free", "clamped"]), default="free", show_default=True)
@click.option("--beam", type=click.Choice(["dynamic", "static"]), default="dynamic", show_default=True)
@click.option("--load", "load_text", help="As for simulate.")
@click.option("--out", type=_OUT, required=True, help=".cir: a deck that runs as it is; .lib: a subcircuit.")
def netlist(actuator: str, drive: str, duration: str, tip: str, beam: str, load_text: str | None, out: Path) -> None:
    """Write the strip as a SPICE netlist."""
    from .actuator_file import load_actuator
    from .circuit.deck import deck
    from .circuit.drive import parse_drive
    from .circuit.library import library
    from .circuit.strip import parse_load, strip_netlist
    from .files import write_text
    from .units import parse

    strip = load_actuator(actuator)
    if out.suffix.lower() == ".lib":
        text = library(strip)
    elif out.suffix.lower() in (".cir", ".sp", ".spice", ".net"):
        seconds = parse(duration, "s", "--duration")
        if not seconds > 0:
            raise InputError(f"duration {duration} must be more than zero")
        circuit = strip_netlist(strip, tip=tip, beam=beam, load=parse_load(load_text))
        text = deck(circuit, parse_drive(drive, seconds), seconds, strip)
    else:
        raise InputError(f"cannot tell what to write to '{out}': end its name in .cir (a deck) or .lib (a subcircuit)")
    write_text(out, text)
    click.echo(f"wrote {out}")


@cli.command()
@click.argument("data", type=click.Path(path_type=Path), nargs=-1, required=True)
@click.option("--actuator", help="The strip that was measured: its sizes, E, electrodes. TOML file or preset.")
@click.option("--model", default="auto", show_default=True, help="rc, rc2, rc3, warburg, cpe; +sinh, +growing; auto.")
@click.option("--electrode-resistance", help="Held in the fit, such as 2ohm.  [default: the actuator's]")
@click.option("--engine", type=click.Choice(["ngspice", "exact"]), default="ngspice", show_default=True)
@click.option("--out", type=_OUT, help="TOML file for the fitted actuator.")
@click.option("--json", "json_path", type=_OUT, help="JSON file for the result.")
@click.option("--plot", type=_OUT, help="Picture of data, fit and residuals (.png, .pdf, .svg).")
@click.option("--report", type=_OUT, help="One HTML file with all of it.")
def identify(data: tuple[Path, ...], actuator: str | None, electrode_resistance: str | None, **options: Any) -> None:
    """Fit a strip to a measured step, waveform or impedance spectrum.

    DATA is a CSV file with a name and a unit in every header: time_s, voltage_V, current_mA, displacement_mm; or a
    spectrum: frequency_Hz, re_ohm, im_ohm, or what EC-Lab (text), Gamry (.DTA) and ZPlot (.z) export. Several records
    of one strip are fitted together (currents only), and each is predicted from the others.
    """
    from .actuator_file import load_actuator
    from .cli_joint import identify_together
    from .cli_spectrum import identify_file
    from .files import require_writable
    from .identify import identify as fit
    from .identify import read_measurement
    from .identify.report import plot_identification, table, write_actuator, write_json
    from .identify.spectrum_files import is_spectrum
    from .plots import require_picture
    from .units import parse

    outputs = [options[k] for k in ("out", "json_path", "plot", "report") if options[k]]
    if len({p.resolve() for p in (*data, *outputs)}) < len(data) + len(outputs):
        raise InputError("two of DATA, --out, --json, --plot and --report name the same file; give each its own")
    for path in (options["out"], options["json_path"], options["report"]):
        if path:
            require_writable(path)
    if options["plot"]:
        require_picture(options["plot"])
    base = load_actuator(actuator) if actuator else None
    held = parse(electrode_resistance, "ohm", "--electrode-resistance") if electrode_resistance else None
    spectra = [path for path in data if is_spectrum(path)]
    if spectra and (len(data) > 1 or options["report"]):
        raise InputError(f"'{spectra[0]}' is a spectrum: give it alone, and without --report")
    if spectra:
        identify_file(data[0], base, held, options["model"], **{k: options[k] for k in ("out", "json_path", "plot")})
        return
    if len(data) > 1:
        identify_together(data, base, held, options)
        return
    measurement = read_measurement(data[0])
    with _counter() as advance:
        result = fit(
            measurement,
            base=base,
            model=options["model"],
            electrode_resistance=held,
            engine=options["engine"],
            progress=advance,
        )
    if options["out"]:
        write_actuator(result, options["out"])
    if options["json_path"]:
        write_json(result, options["json_path"])
    if options["plot"]:
        plot_identification(result, options["plot"])
    if options["report"]:
        from .identify.html_report import write_report

        write_report(result, options["report"], shlex.join(["ilg-circuit", *sys.argv[1:]]))
    click.echo(table(result))
    for line in result.warnings:
        click.echo(f"warning: {line}", err=True)


@cli.command()
@click.option("--out", type=_OUT, default=Path("demo"), show_default=True, help="Folder for the results.")
def demo(out: Path) -> None:
    """The whole flow once, with pictures: simulate, check, measure with noise, identify, hand out."""
    from .demo import run

    for line in run(out):
        click.echo(line)


@cli.command()
def doctor() -> None:
    """Versions, the ngspice library, and a self-check against the closed form."""
    from .doctor import examine

    for line in examine():
        click.echo(line)


@contextmanager
def _counter() -> Iterator[Callable[[], None]]:
    """A count of model evaluations on stderr, for a fit whose number of them nobody knows; as `_progress`."""
    from tqdm import tqdm

    with tqdm(delay=1.0, disable=None, leave=False, unit="evaluation", desc="fitting") as bar:
        yield lambda: _advance(bar)


def _advance(bar: Any) -> None:
    bar.update()


def _progress() -> Progress:
    """A progress bar on stderr that shows up when the work takes more than a second, and only in a terminal."""
    from tqdm import tqdm

    bar = tqdm(total=None, delay=1.0, disable=None, leave=False, unit="run")

    def advance(done: int, total: int) -> None:
        bar.total = total
        bar.update(done - bar.n)
        if done >= total:
            bar.close()

    return advance
