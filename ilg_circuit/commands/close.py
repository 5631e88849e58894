"""The command ``close``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..simulation.drives import MOTIONS
from .emit import emit
from .help import group
from .options import SEED, actuator_argument, beam_option, engine_option, load_option, output_options, outputs
from .paths import ANY, DECK, FILE, TABLE, LongCommand
from .tune import delay_option


@click.command(
    cls=LongCommand,
    examples=(
        "close fitted.toml --controller tuned.json --reference step:3mm --duration 60s --period 0.1s --plot loop.png",
        "close fitted.toml --controller own.py --reference sine:1mm,5mHz --duration 400s --period 40ms --delay 40ms",
    ),
    tables={"Forms of MOTION": MOTIONS},
)
@actuator_argument
@group(
    "Controller",
    click.option(
        "--controller",
        type=FILE,
        required=True,
        help="JSON file of tune; or a Python file with step(reference, measured) -> voltage, which is run.",
    ),
    click.option("--reference", required=True, metavar="MOTION", help="Where the tip shall be; its forms are below."),
    click.option("--duration", required=True, metavar="TIME", help="How long the run is, such as 60s."),
    click.option(
        "--form",
        type=click.Choice(["sampled", "behavioural", "op-amps"]),
        default="sampled",
        help="sampled: called at every period; behavioural, op-amps: a tuned one in the circuit, as sources or parts.",
    ),
    click.option("--period", metavar="TIME", help="Time between calls of a sampled controller, such as 0.1s."),
    click.option("--computation", default="0s", metavar="TIME", help="Time from a call to its voltage."),
    click.option("--jitter", default="0s", metavar="TIME", help="By so much later a voltage may come, by chance."),
    click.option("--voltage", metavar="VOLTAGE", help="Limit of the voltage.  [default: the controller's, else 4V]"),
)
@group(
    "Power stage",
    click.option(
        "--pwm", metavar="FREQUENCY", help="An H-bridge that switches its --supply so often.  [default: no switching]"
    ),
    click.option("--duty-steps", type=int, default=256, metavar="N", help="Steps of its duty."),
)
@group(
    "A strip that drifts",
    click.option(
        "--drift",
        metavar="CHANGES",
        help="Changes over the run, such as capacitance=-40%,dynamic_resistance=+80%; also dc_resistance, gain.",
    ),
    click.option("--adapt", is_flag=True, help="Have a tuned PI identify the strip and reschedule its gains."),
)
@group(
    "Sensor",
    delay_option,
    click.option("--noise", default="0m", metavar="LENGTH", help="Standard deviation of a measurement, such as 5um."),
    click.option("--quantum", default="0m", metavar="LENGTH", help="Step of the measurement, such as 10um."),
    click.option("--seed", type=SEED, default=0, help="Seed of the noise."),
)
@group(
    "Op-amps",
    click.option(
        "--gain-bandwidth", metavar="FREQUENCY", help="Gain-bandwidth product of the amplifiers.  [default: 1MHz]"
    ),
    click.option("--supply", metavar="VOLTAGE", help="Their supply, or that of --pwm.  [default: 15V; the limit]"),
    click.option("--sensor-gain", metavar="GAIN", help="Voltage of sensor and reference.  [default: 1V/mm]"),
)
@group("Sampling", click.option("--samples", type=int, default=601, metavar="N", help="Number of samples returned."))
@beam_option
@load_option
@engine_option
@group(
    "Output",
    click.option("--netlist", type=DECK, help="SPICE deck of a loop in the circuit to write."),
    click.option("--parts", type=TABLE, help="Parts list of a controller with op-amps to write, as CSV."),
    click.option("--c-code", type=ANY, help="C file of a tuned controller, sampled, to write."),
)
@output_options("CSV file to write.", "Picture to write (.png, .pdf, .svg).")
def close(
    actuator: str, controller: Path, netlist: Path | None, parts: Path | None, c_code: Path | None, **options: Any
) -> None:
    """Close the position loop around a strip, in ngspice or exactly.

    A sampled controller is called at every period within the transient: ngspice stops there, and goes on with its
    voltage. A behavioural one is a part of the circuit, as --netlist writes it. With --form op-amps a PI is made of
    operational amplifiers, E24 resistors and E12 capacitors, to be built from --netlist and --parts.
    """
    from ..errors import InputError
    from ..files import write_csv, write_text
    from ..front.control import close_loop as run
    from ..front.control import controller_code

    code = None if c_code is None else controller_code(controller, options["period"], options["voltage"])
    written = outputs(options)
    if netlist is not None and options["form"] == "sampled":
        raise InputError("--netlist is of a loop in the circuit; give --form behavioural or op-amps with it")
    if parts is not None and options["form"] != "op-amps":
        raise InputError("--parts is of a controller to build; give --form op-amps with it")
    closed = run(actuator, controller, **options)
    emit(
        closed,
        {**written, "--netlist": netlist, "--parts": parts, "--c-code": c_code},
        inputs=(actuator, controller),
        seed=options["seed"],
        writers={
            "--netlist": lambda result, path: write_text(path, result.netlist),
            "--parts": lambda result, path: write_csv(path, result.circuit.table() if result.circuit else {}),
            "--c-code": lambda result, path: write_text(path, code or ""),
        },
    )
