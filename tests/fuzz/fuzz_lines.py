"""Random command lines: every command with its options, most values good, some wrong, absurd or hostile.

The options come from the commands themselves, so that none is forgotten; what is good for one, by name, stands in
`GOOD`.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import click
import numpy as np

from ilg_circuit.commands import COMMANDS

#: Demo and reproduce take minutes; doctor has no options; watch and app go on until they are interrupted.
WEIGHTS = {
    "show": 2, "simulate": 5, "impedance": 3, "bode": 2, "netlist": 2,
    "identify": 2, "sense": 2, "sweep": 1, "design": 1,
    "new": 1, "ogden": 2, "cpg": 3, "arm": 1, "page": 1, "examples": 1, "doctor": 0, "demo": 0, "reproduce": 0,
    "watch": 0, "app": 0, "tune": 1, "track": 1, "close": 1, "learn": 1,
}  # fmt: skip
STRIPS = (
    *("paper",) * 4,
    "strip.toml",
    "rc2.toml",
    "sinh.toml",
    "growing.toml",
    "warburg.toml",
    "plain.toml",
    "four.toml",
    "layered.toml",
)
_LENGTHS = ("0.3mm", "0.5mm", "1mm", "5mm", "30mm")
_DRIVES = (
    "step:4V", "step:-1V", "square:4V,3s", "square:-2V..2V,4s,0.3", "sine:2V,0.5Hz", "ramp:1V/s", "file:drive.csv",
    "step:0V", "square:1V,7s,0.999", "sine:0V,1Hz", "current:5mA", "current:10mA,limit=2V", "square:2mA,3s",
)  # fmt: skip
_VARIED = ("thickness=0.3mm:0.8mm:3", "width=5mm,6mm", "voltage=1V:4V:2", "orientation=hanging,weightless",
           "load_mass=0mg,10mg", "gain=1e-9m/(V s):3e-9m/(V s):2:log", "period=1s:2s:2",
           "gel_thickness=0.2mm,0.4mm")  # fmt: skip
_RANGES = (
    "thickness=0.3mm:0.8mm",
    "width=3mm:6mm",
    "width=5mm",
    "free_length=20mm:30mm",
    "voltage=1V:3V",
    "carbon_thickness=20um:60um",
)
_OUTPUTS = ("displacement_final", "force_blocked", "settling_time", "energy", "current_peak", "time_of_90")

#: option -> good values; "command option" for one command alone.
GOOD: dict[str, tuple[str, ...]] = {
    "--drive": _DRIVES,
    "simulate --drive": (*_DRIVES, "1=step:1V", "2=sine:1V,1Hz", "-1=step:1V", "2=open", "file:segments.csv"),
    "netlist --drive": (*_DRIVES, "1=step:1V", "2=square:-1V..1V,1s"),
    "--segment": ("1", "2", "4"),
    "--motion": ("step:1mm", "square:1mm,3s", "sine:1mm,0.5Hz", "ramp:0.1mm/s", "file:motion.csv"),
    "--duration": ("1s", "10s", "100 s", "5ms", "0.1 min"),
    "cpg --duration": ("1s", "3s", "0.2s"),
    "cpg --strip": STRIPS,
    "cpg --reflex": ("1", "30", "-2"), "cpg --rest-angle": ("0", "0.01"), "cpg --entrain": ("0.05", "0.2"),
    "arm --duration": ("5ms", "20ms", "1ms"),
    "--samples": ("2", "3", "50", "601"),
    "arm --samples": ("3", "11"),
    "--step": ("0.1s", "1s", "7ms"),
    "tune --step": ("3mm", "1mm"), "tune --to": ("settling=60s", "bandwidth=10mHz"), "--delay": ("40ms", "0s"),
    "--controller": ("own.py", "tuned.json"), "close --reference": ("step:1mm",), "tune --controller": ("tuned.json",),
    "close --period": ("0.1s", "0.5s"), "--computation": ("0s", "10ms"), "--drift": ("gain=-20%",),
    "--jitter": ("5ms",), "--pwm": ("1kHz", "50Hz"), "--duty-steps": ("256",), "--noise": ("5um",),
    "--quantum": ("10um",), "close --samples": ("11", "51"), "--c-code": ("law.c",),
    "--gain-bandwidth": ("1MHz", "10kHz"), "--supply": ("15V", "9V"), "--sensor-gain": ("1V/mm",),
    "--parts": ("parts.csv",),
    "--path": ("step:1mm", "sine:1mm,10mHz", "file:motion.csv"), "--quantity": ("displacement", "force", "shape"),
    "track --path": ("step:1mm", "sine:1mm,10mHz", "file:motion.csv", "step:50nN", "sine:50nN,10mHz",
                     "1=sine:5 1/m,10mHz", "curvature_2=step:1 1/m", "angle=step:0 rad", "file:bend.csv"),
    "track --voltage": ("4V", "4V,2V", "3V,3V,3V,3V"),
    "--nodes": ("20", "51"), "--slew": ("1V/s",),
    "learn --trials": ("1", "3"), "--bandwidth": ("20mHz",), "--gain": ("1", "0.5"), "learn --trial": ("trial.csv",),
    "--current": ("50mA",), "--energy": ("2J",),
    "--gains": ("gain=5V/mm,reset_time=15s", "gain=20V/mm,reset_time=10s"), "--tracking-time": ("1s",),
    "--sensitivity": ("1.6", "2"), "--overshoot": ("5%", "20%"), "--draws": ("0", "5"),
    "cpg --step": ("1ms", "10ms"),
    "arm --step": ("1ms", "5ms"),
    "--load": ("mass=1g", "stiffness=1mN/m", "mass=10mg,damping=1uN*s/m", "mass=0g"),
    "--accuracy": ("1e-4", "1e-6", "1e-3"),
    "--record": ("step.csv", "ramps.csv", "square.csv"), "--skip": ("1s", "0s"),
    "--from": ("1mHz", "0.1Hz", "1uHz"),
    "--to": ("10Hz", "1kHz", "1MHz"),
    "--points": ("2", "5", "20"),
    "design --points": ("2", "3"),
    "--bias": ("0V", "1V", "-2V"),
    "identify --coupling": ("ec31", "charge1", "voltage3", "auto"),
    "identify --bias": ("0V", "spectrum.csv=0.5V"),
    "--voltage": ("4V", "-1V", "0V"),
    "--actuator": STRIPS,
    "--model": ("rc", "rc", "rc2", "warburg", "cpe", "randles", "rc+inductance", "rc3"),
    "ogden --model": ("auto", "ogden", "neo-hookean", "mooney-rivlin"),
    "--electrode-resistance": ("2ohm", "0 ohm", "fit"),
    "--own": ("dc_resistance", "capacitance"),
    "--onset": ("10s", "last-rest", "first-level", "step.csv=10s"),
    "--displacement-delay": ("0.1s", "0s", "fit"),
    "--displacement": ("tip.csv",), "--scale": ("0.042mm/px",), "--fps": ("25",), "--axis": ("x", "30deg"),
    "--until": ("16s", "60s"),
    "--vary": _VARIED,
    "design --vary": _RANGES,
    "--random": ("2", "3"),
    "--seed": ("0", "1", "12345"),
    "--designs": ("designs.csv",),
    "--outputs": _OUTPUTS,
    "--waveforms": ("current", "charge,displacement"),
    "--plot-outputs": _OUTPUTS[:2],
    "--jobs": ("1",),
    "--require": ("displacement_final>=1mm", "settling_time<=60s", "energy<=2J", "valid", "slenderness>=10"),
    "--minimise": ("energy", "thickness"),
    "--maximise": ("displacement_final", "force_blocked"),
    "--pareto": ("displacement_final,force_blocked", "displacement_final,min:energy"),
    "--confidence": ("95%", "0.9"),
    "--uniaxial": ("uniaxial.csv",),
    "--equibiaxial": ("equibiaxial.csv",),
    "--planar": ("planar.csv",),
    "--terms": ("1", "2", "3"),
    "--at": ("1.5", "0.7", "3"),
    "--neurons": ("2", "3", "4"),
    "--weights": ("weights.csv",),
    "ogden --weights": ("absolute", "relative"),
    "--inhibition": ("2.5", "1", "0"),
    "--adaptation": ("3", "0", "10"),
    "--tonic": ("1", "0.1"),
    "--same": ("0.1", "0"),
    "--cross": ("0.1", "0"),
    "--rise-time": ("0.12s", "50ms"),
    "--adaptation-time": ("0.3s", "1s"),
    "--start": ("0.12,0,0,0", "0.1,0.2,0.3,0.4"),
    "--sweep": ("inhibition=1:5:3", "tonic=0.5:2:2", "rise-time=0.1s:0.2s:2"),
    "--segments": ("2", "3", "5"),
    "--reference": ("1", "0.5"),
    "--slower": ("1", "2"),
    "--reach": ("29mm,4mm",),
    "--within": ("1mm", "5mm"),
    "--amplitude": ("0.001", "0.02"),
    "--period": ("1s", "0.1s"),
    "--rest-ratio": ("0.5", "0.8"),
    "--tolerance": ("1e-6", "1e-4"),
    "--columns": ("voltage=voltage_V",), "--units": ("time=s", "current=mA"), "--part": ("1",), "--cycle": ("1",),
    "--length": ("35mm",), "--free-length": ("30mm", "3cm"), "--width": ("5mm", "0,5 cm"), "--thickness": ("0.5mm",),
    "--load-position": ("20mm",), "--youngs-modulus": ("7.6kPa",), "--density": ("1.2g/cm^3",), "--name": ("gel",),
    "--bending-stiffness": ("1 uN m^2",), "file": ("new.toml",), "--log": ("out.log",), "--folder": ("results",),
    "--table": ("out.tex", "out.md", "table.csv"), "--section": ("10mm^2",),
    "--time-limit": ("100s",), "--compare": ("step.csv",), "--cluster": ("local:1",),
    "--out": ("out.csv",),
    "identify --out": ("out.toml",), "ogden --out": ("out.toml",), "design --out": ("out.toml",),
    "netlist --out": ("out.cir", "out.lib"), "sweep --out": ("out.nc",), "arm --out": ("out.nc",),
    "page --out": ("out.html",), "examples --out": ("copies",), "names": ("simulate_and_plot", "own_driver"),
    "--kit": ("kit",), "--port": ("5099",),
    "--json": ("out.json",),
    "--plot": ("out.png", "out.svg"), "--size": ("85mm", "85mm,60mm", "0.2 m"), "--style": ("journal.mplstyle",),
    "--sobol-plot": ("sobol.png",),
    "--front": ("front.csv",),
    "--report": ("out.html",),
    "--netlist": ("deck.cir",),
    "--animate": ("out.gif",), "--shape": ("shape.csv",), "--plot-shape": ("shape.png",),
    "--frequency": ("0.1Hz", "1Hz"), "--places": ("10mm,20mm,30mm", "15mm"),
    "--lengths": ("35mm", "20mm,35mm"), "--contact": ("end", "both"), "--contact-length": ("5mm", "0mm"),
    "actuator": STRIPS,
    "data": ("step.csv", "square.csv", "ramps.csv", "spectrum.csv", "low.csv", "$odd.csv"),
}  # fmt: skip
#: Seconds each: so rarely.
_RARE = {"--record": 0.1, "--skip": 0.05, "--sensing": 0.05, "--size": 0.01, "--style": 0.01,
         "--plot": 0.05, "--report": 0.05, "--animate": 0.01, "--reach": 0.02, "--pareto": 0.05, "--sobol": 0.02,
         "--sobol-plot": 0.02, "--intervals": 0.03, "--cluster": 0.0, "--sensitivity": 0.05, "--confidence": 0.05,
         "--sobol_plot": 0.0, "--help": 0.01, "--settled": 0.1, "--neurons-in-circuit": 0.1, "--each": 0.0,
         "--shape": 0.05, "--plot-shape": 0.02, "--frequency": 0.02, "--places": 0.02,
         "--drift": 0.05, "--adapt": 0.05, "--pwm": 0.05, "--duty-steps": 0.05, "--jitter": 0.05,
         "--gain-bandwidth": 0.05, "--supply": 0.05, "--sensor-gain": 0.05, "--parts": 0.05,
         "--sheets": 0.05,  "--lengths": 0.02, "--contact": 0.02, "--contact-length": 0.02,
         "--folder": 0.01, "--kit": 0.05, "--log": 0.01,
         **dict.fromkeys(("--length", "--free-length", "--width", "--thickness",
         "--load-position", "--youngs-modulus", "--density", "--bending-stiffness", "--orientation"), 0.03),
         }  # fmt: skip
#: Must be there, or the command waits for more processes than one, or tries all models.
_ALWAYS = {"--jobs": ("sweep",), "--segments": ("arm",), "--samples": ("arm",), "--duration": ("cpg",),
           "--require": ("design",), "--vary": ("design", "sweep"), "--uniaxial": ("ogden",),
           "--gains": ("tune",), "--nodes": ("track", "learn"), "--period": ("close",),
           "--model": ("identify",), "--json": ("identify",)}  # fmt: skip
_SIZES = ("0", "-1", "1e-300", "5e-324", "1e308", "-1e300", "1e-13", "1e13", "nan", "inf", "1e999", "9" * 5000, "1_0")
_UNITS = ("mm", "m", "V", "kV", "s", "Hz", "rad/s", "ohm", "Pa", "px", "degC", "%", "\N{MICRO SIGN}m", "")
_SCRAPS = (
    "", " ", "-", "--", "$\\foo$", "\x1b[2J", "a\nb", "caf\udce9", "\N{PILE OF POO}", "../x", "/dev/null", ".", "{}",
    "a=b=c", "::::", ",,,,", "step:", "file:", "file:absent.csv", "file:step.toml", "x" * 3000, " " * 3000 + "x",
    "absent.toml", "none/out.csv", "out.xyz", "paper", "valid", "=", ">=", "1e", "0x10", "'", '"', ";", "None",
)  # fmt: skip


def command(name: str) -> click.Command:
    found: click.Command = getattr(import_module(f"ilg_circuit.commands.{name}"), name)
    return found


def command_line(seed: int) -> list[str]:
    """Return the command line of a seed: the same on every machine."""
    random = np.random.default_rng(seed)
    names = [name for name in COMMANDS if WEIGHTS[name]]
    weights = np.array([WEIGHTS[name] for name in names], dtype=float)
    name = names[int(random.choice(len(names), p=weights / weights.sum()))]
    wrong = random.random() < 0.5
    words: list[str] = []
    for parameter in command(name).params:
        words += _parameter(name, parameter, random, wrong)
    if wrong and random.random() < 0.1:
        words.insert(int(random.integers(len(words) + 1)), _hostile(random))
    return [name, *words]


def _parameter(name: str, parameter: click.Parameter, random: np.random.Generator, wrong: bool) -> list[str]:
    option = parameter.opts[0]
    always = parameter.required or name in _ALWAYS.get(option, ())
    chance = 1.0 if always else _RARE.get(option, 0.25)
    if wrong and always and random.random() < 0.03:
        return []
    words: list[str] = []
    several = parameter.multiple if isinstance(parameter, click.Option) else parameter.nargs < 0
    while random.random() < chance:
        value = [] if getattr(parameter, "is_flag", False) else [_value(name, parameter, random, wrong)]
        words += [option, *value] if isinstance(parameter, click.Option) else value
        if not several or random.random() < 0.6:
            break
    return words


def _value(name: str, parameter: click.Parameter, random: np.random.Generator, wrong: bool) -> str:
    option = parameter.opts[0]
    if wrong and random.random() < 0.12:
        return _hostile(random)
    choices: Any = getattr(parameter.type, "choices", None)
    values = GOOD.get(f"{name} {option}") or choices or GOOD[option]
    value: str = values[int(random.integers(len(values)))]
    if wrong and random.random() < 0.05:  # a good value with one sign changed
        place = int(random.integers(len(value) + 1))
        value = value[:place] + _SCRAPS[int(random.integers(8))] + value[place + 1 :]
    return value


def _hostile(random: np.random.Generator) -> str:
    how = int(random.integers(4))
    size, unit = _SIZES[int(random.integers(len(_SIZES)))], _UNITS[int(random.integers(len(_UNITS)))]
    if how == 0:
        return size + unit
    if how == 1:
        drives = (
            f"step:{size}{unit}",
            f"sine:{size}V,1Hz",
            f"sine:1V,{size}Hz",
            f"square:1V,{size}s",
            f"ramp:{size}V/s",
        )
        return drives[int(random.integers(len(drives)))]
    if how == 2:
        key = ("thickness", "mass", "length", "displacement_final", "inhibition")[int(random.integers(5))]
        return f"{key}{('=', '>=', '<=')[int(random.integers(3))]}{size}{unit}:1mm:{size}"
    return _SCRAPS[int(random.integers(len(_SCRAPS)))]
