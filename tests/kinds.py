"""One strip, the paper's, measured in every way: a step, a waveform, a spectrum, and three files together."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from synthetic import drives, record, spectrum, step, write_spectrum

from ilg_circuit.identification import Identification, identify
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.strip.actuator import PAPER

KINDS = ("step", "waveform", "spectrum", "several")
_NOISE = 3e-3
_STEP = record(step(), 300.0, 151, rest=20, displacement=True, noise=_NOISE, rest_position=5e-3, seed=11)
_BACK = record(step(-2.0), 150.0, 151, rest=20, displacement=True, noise=_NOISE, rest_position=-1e-3, seed=2)
_SQUARE = record(drives(4.0)["square"], 300.0, 301, rest=20, displacement=True, noise=_NOISE, seed=12)
_SPECTRUM = spectrum(PAPER, 1e-3, 1e2)


@cache
def data(kind: str) -> tuple[Record | Spectrum, ...]:
    """The files of a kind."""
    if kind == "several":
        return _STEP.measurement("step.csv"), _BACK.measurement("back.csv"), _SPECTRUM
    return ({"step": _STEP.measurement, "waveform": _SQUARE.measurement, "spectrum": lambda: _SPECTRUM}[kind](),)


def write(kind: str, folder: Path) -> list[str]:
    """The same as files for the command line."""
    made = {"step.csv": _STEP, "back.csv": _BACK, "square.csv": _SQUARE, "z.csv": _SPECTRUM}
    names = {"step": ["step.csv"], "waveform": ["square.csv"], "spectrum": ["z.csv"]}
    chosen = names.get(kind, ["step.csv", "back.csv", "z.csv"])
    for name in chosen:
        source = made[name]
        if isinstance(source, Spectrum):
            write_spectrum(source, folder / name)
        else:
            source.write(folder / name)
    return [str(folder / name) for name in chosen]


@cache
def identified(kind: str, model: str = "rc", **how: Any) -> Identification:
    """What is found with the exact engine; made once a process."""
    return identify(data(kind), base=PAPER, model=model, engine="exact", **how)
