"""The runs of the contract: what is asked of the command line, and what is kept of the answer.

`perform` makes a run in this process and returns plain data that JSON can hold:

- ``exit_code``; ``warnings`` and ``refusals``: how many lines of each kind are on stderr;
- ``outputs``: JSON files, and JSON on stdout, as they are; TOML files parsed; tables (CSV) and netCDF files as columns
  of at most `KEPT` values evenly chosen, with the largest of all; netlists as lines of words without comments, which
  hold the version; of pictures and pages only that they are there.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import inputs
import numpy as np

#: Most values kept of a column or of a variable.
KEPT = 20


@dataclass(frozen=True)
class Run:
    """One run: ``outputs`` are the files kept, stdout among them; ``klass`` is that of the tolerances.

    ``family`` says which kind of fit.json it writes: one record, one spectrum, or several files.
    """

    name: str
    arguments: str
    outputs: tuple[str, ...] = ()
    klass: str = "exact"
    family: str = ""


#: Samples of the inputs at jumps are right limits, as 0.1.0 took those of every record to be.
_ONSET = " --onset first-level"


def _fit(name: str, arguments: str, family: str, klass: str = "exact", toml: bool = False) -> Run:
    outputs = ("fit.json", "fit.toml") if toml else ("fit.json",)
    line = f"identify {arguments}" + (_ONSET if family != "spectrum" else "")
    line += " --actuator paper --json fit.json" + (" --out fit.toml" if toml else "")
    return Run(name, line, outputs, klass, family)


_STEP = "--drive step:2V --duration 60s"
_TESTS = "--uniaxial uniaxial.csv --equibiaxial equibiaxial.csv --planar planar.csv"
_NARROW = "--vary thickness=0.3mm:0.8mm"

RUNS = (
    # one record
    _fit("step", "step.csv --model rc --engine exact", "record", toml=True),
    _fit("step_by_ngspice", "step.csv --model rc", "record", "ngspice", toml=True),
    _fit("step_auto", "two_branches.csv --engine exact", "record", toml=True),
    _fit("step_alike_residuals", "two_branches.csv --model rc --engine exact", "record", toml=True),
    _fit("step_held_resistance", "step.csv --model rc --engine exact --electrode-resistance 2ohm", "record"),
    _fit("step_bootstrap", "two_branches.csv --model rc2 --engine exact --intervals bootstrap", "record"),
    _fit("step_profile", "two_branches.csv --model rc2 --engine exact --intervals profile", "record"),
    _fit("step_mcmc", "two_branches.csv --model rc2 --engine exact --intervals mcmc", "record"),
    _fit("square", "square.csv --model rc --engine exact", "record"),
    _fit("ramps_auto", "ramps.csv --engine exact", "record"),
    # one spectrum
    _fit("spectrum", "spectrum.csv --model rc2", "spectrum", toml=True),
    _fit("spectrum_auto", "spectrum.csv", "spectrum"),
    _fit("spectrum_cpe", "spectrum.csv --model cpe", "spectrum", toml=True),
    _fit("spectrum_profile", "spectrum.csv --model rc2 --intervals profile", "spectrum"),
    # several files of one strip
    _fit("several", "low.csv high.csv impedance.csv --model rc --engine exact", "several", toml=True),
    _fit("several_auto", "low.csv impedance.csv --engine exact", "several"),
    _fit(
        "several_own",
        "low.csv high.csv other.csv --own capacitance --own dynamic_resistance --model rc --engine exact",
        "several",
        toml=True,
    ),
    _fit("several_stranger", "low.csv high.csv other.csv --model rc --engine exact", "several"),
    _fit("several_sinh", "sinh_1V.csv sinh_2V.csv sinh_3V.csv --model rc+sinh", "several", "ngspice", toml=True),
    _fit("several_growing", "growing_1V.csv growing_3V.csv --model rc+growing", "several", "ngspice"),
    # pictures and pages
    Run(
        "report",
        f"identify step.csv --model rc --engine exact{_ONSET} --plot fit.png --report fit.html",
        ("fit.png", "fit.html"),
    ),
    # a strip's answers
    Run("show", "show strip.toml --voltage 2V --json", ("stdout",)),
    Run("simulate", f"simulate strip.toml {_STEP} --samples 61 --with-energy --out a.csv", ("a.csv",), "ngspice"),
    Run("simulate_exact", f"simulate paper {_STEP} --samples 61 --engine exact --out a.csv", ("a.csv",)),
    Run(
        "simulate_clamped",
        "simulate paper --drive sine:2V,0.05Hz --duration 60s --step 1s --tip clamped --check --out a.csv",
        ("a.csv",),
        "ngspice",
    ),
    Run(
        "simulate_band",
        "simulate strip.toml --drive square:2V,20s --duration 60s --samples 61 --engine exact --band --out a.csv",
        ("a.csv",),
    ),
    Run(
        "simulate_record",
        "simulate strip.toml --drive file:square.csv --duration 60s --samples 61 --engine exact --out a.csv",
        ("a.csv",),
    ),
    Run("impedance", "impedance paper --points 20 --bias 1V --out z.csv", ("z.csv",), "ngspice"),
    Run("impedance_exact", "impedance strip.toml --from 1mHz --to 10Hz --engine exact --out z.csv", ("z.csv",)),
    Run("sense", "sense paper --motion step:1mm --duration 60s --samples 61 --out m.csv", ("m.csv",), "ngspice"),
    Run(
        "sense_exact",
        "sense paper --motion sine:1mm,0.05Hz --duration 60s --terminals short --engine exact --out m.csv",
        ("m.csv",),
    ),
    Run("netlist_lib", "netlist paper --out strip.lib", ("strip.lib",)),
    Run("netlist_cir", "netlist strip.toml --drive square:2V,10s --duration 30s --out strip.cir", ("strip.cir",)),
    # material, rhythm, arm
    Run("ogden_uniaxial", "ogden --uniaxial uniaxial.csv --json", ("stdout",)),
    Run("ogden", f"ogden {_TESTS} --at 2 --json --actuator paper --out soft.toml", ("stdout", "soft.toml")),
    Run("cpg", "cpg --duration 5s --samples 101 --json --out rhythm.csv", ("stdout", "rhythm.csv")),
    Run("cpg_sweep", "cpg --sweep inhibition=1:3:3 --out table.csv", ("table.csv",)),
    Run("arm", "arm --segments 3 --duration 0.5s --samples 11 --out arm.nc", ("arm.nc",), "steps"),
    Run(
        "arm_yekutieli",
        "arm --segments 3 --formulation yekutieli --activation wave --duration 0.2s --samples 11 --out arm.nc",
        ("arm.nc",),
        "steps",
    ),
    # many strips
    Run(
        "sweep",
        f"sweep paper --vary thickness=0.3mm:0.6mm:3 --vary voltage=1V,2V {_STEP} --waveforms displacement "
        "--samples 31 --engine exact --jobs 1 --out grid.nc",
        ("grid.nc",),
    ),
    Run(
        "sweep_random",
        f"sweep strip.toml --vary thickness=0.3mm:0.6mm --random 3 {_STEP} --jobs 1 --out grid.nc",
        ("grid.nc",),
        "ngspice",
    ),
    Run(
        "design",
        f"design paper {_NARROW} --require displacement_final>=1mm --maximise force_blocked {_STEP} --engine exact "
        "--json design.json --out design.toml",
        ("design.json", "design.toml"),
    ),
    Run(
        "design_front",
        f"design strip.toml {_NARROW} --pareto displacement_final,force_blocked --points 5 {_STEP} --engine exact "
        "--json design.json --front front.csv",
        ("design.json", "front.csv"),
    ),
    # refusals
    Run("refused_file", "identify absent.csv --model rc"),
    Run("refused_model", "identify step.csv --model rc9"),
    Run("refused_engine", "identify sinh_1V.csv sinh_3V.csv --model rc+sinh --engine exact"),
    Run("refused_own", "identify low.csv high.csv --model rc --engine exact --own stiffness"),
    Run("refused_intervals", f"identify low.csv high.csv --model rc --engine exact{_ONSET} --intervals profile"),
    Run("refused_drive", "simulate paper --drive step:4 --duration 60s"),
    Run("refused_design", f"design paper {_NARROW} --require displacement_final>=40mm {_STEP} --engine exact"),
)


def perform(run: Run, folder: Path) -> dict[str, Any]:
    """Make ``run`` in the empty ``folder`` and return what is kept of it."""
    inputs.write(folder, run.arguments.split())
    code, out, err = command_line(run.arguments.split(), folder)
    lines = err.splitlines()
    return {
        "arguments": run.arguments,
        "exit_code": code,
        "warnings": sum(line.startswith("warning: ") for line in lines),
        "refusals": sum(line.startswith("ilg-circuit: ") for line in lines),
        "outputs": {name: _kept(name, folder / name, out) for name in run.outputs},
    }


def command_line(arguments: Sequence[str], folder: Path) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of the program's entry point in this process, its working directory ``folder``."""
    from ilg_circuit.cli import main

    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(list(arguments))
        except SystemExit as ended:
            code = int(ended.code or 0)
    return code, out.getvalue(), err.getvalue()


def _kept(name: str, path: Path, stdout: str) -> Any:
    if name == "stdout":
        return json.loads(stdout)
    if not path.is_file():
        return None
    match path.suffix:
        case ".json":
            return json.loads(path.read_text(encoding="utf-8"))
        case ".toml":
            return tomllib.loads(path.read_text(encoding="utf-8"))
        case ".csv":
            return _table(path.read_text(encoding="utf-8"))
        case ".nc":
            return _dataset(path)
        case ".lib" | ".cir":
            return _netlist(path.read_text(encoding="utf-8"))
        case _:
            return {"written": path.stat().st_size > 0}


def _table(text: str) -> dict[str, Any]:
    header, *rows = (line.split(",") for line in text.splitlines())
    columns = zip(*rows, strict=True)
    return {
        "rows": len(rows),
        "columns": {name: _column([_number(x) for x in cells]) for name, cells in zip(header, columns, strict=True)},
    }


def _dataset(path: Path) -> dict[str, Any]:
    import xarray

    with xarray.open_dataset(path, engine="h5netcdf") as data:
        variables = {
            str(name): {"dimensions": list(v.dims), "units": v.attrs.get("units", "")}
            | _column(v.values.ravel().tolist())
            for name, v in data.variables.items()
        }
        return {
            "dimensions": {str(name): size for name, size in data.sizes.items()},
            "attributes": {str(name): "text" if isinstance(v, str) else "number" for name, v in data.attrs.items()},
            "variables": variables,
        }


def _netlist(text: str) -> list[list[float | str | None]]:
    """Every line as its words, numbers among them; a deck's title stays, comments do not."""
    lines = text.replace("\n+", " ").splitlines()
    return [[_number(word) for word in line.split()] for line in lines if line and not line.startswith("*")]


def _column(values: list[Any]) -> dict[str, Any]:
    """At most `KEPT` of the values evenly chosen, first and last among them, and the largest size of all."""
    chosen = np.unique(np.linspace(0, len(values) - 1, min(KEPT, len(values))).round().astype(int)) if values else []
    sizes = [abs(v) for v in values if isinstance(v, float) and math.isfinite(v)]
    return {"values": [_finite(values[k]) for k in chosen], "largest": max(sizes, default=None)}


def _number(word: str) -> float | str | None:
    """The number that ``word`` is, if it is one; None for an empty cell."""
    try:
        return _finite(float(word))
    except ValueError:
        return word or None


def _finite(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def options() -> dict[str, list[str]]:
    """The long options that ``--help`` of every command offers."""
    from ilg_circuit.commands import COMMANDS

    found = {}
    for name in sorted(COMMANDS):
        _, out, _ = command_line([name, "--help"], Path())
        words = (line.replace(",", " ").split() for line in out.splitlines() if line.startswith("  -"))
        found[name] = sorted({word for line in words for word in line[:2] if word.startswith("--")})
    return found


def key_paths(content: Any, path: str = "") -> Iterable[str]:
    """The path of every value in JSON ``content``; items of lists share one."""
    if isinstance(content, dict) and content:
        for key, value in content.items():
            yield from key_paths(value, f"{path}/{key}")
    elif isinstance(content, list) and any(isinstance(item, dict | list) for item in content):
        for item in content:
            yield from key_paths(item, f"{path}[]")
    else:
        yield path


def families(performed: dict[str, dict[str, Any]]) -> dict[str, list[str]]:
    """The key paths of fit.json by the kind of fit, from what ``performed`` kept of each run."""
    found: dict[str, set[str]] = {}
    for run in RUNS:
        if run.family and run.name in performed:
            found.setdefault(run.family, set()).update(key_paths(performed[run.name]["outputs"]["fit.json"]))
    return {family: sorted(paths) for family, paths in found.items()}
