"""The whole flow once: simulate the paper's strip, check it, measure it with noise, identify it, show all of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..circuit.deck import deck
from ..circuit.library import library
from ..drive import PiecewiseLinear
from ..files import write_json, write_text
from ..identification import identify
from ..measurements.read import read_record
from ..report import check as checked
from ..report.axes import save
from ..report.identification import write_actuator
from ..report.page import write_page
from ..simulation.check import check, require_agreement
from ..simulation.response import Response, sample_times, simulate
from ..solve.library import chosen_engine
from ..strip.actuator import PAPER
from ..strip.file import save_actuator
from .demo_page import PAGE, demo_page, next_commands
from .run import make_folder

#: The demonstration's noise, in parts of each waveform's maximum.
_NOISE = 0.005
_REST = 3.0  # seconds at rest before the step
_REST_POSITION = 5.0e-3


def run(folder: Path) -> Iterator[str]:
    """Write everything into ``folder`` (made if absent), saying line by line what is done. Raises IlgErrors."""
    make_folder(folder)
    yield f"1  the paper's strip -> {folder / 'paper.toml'}"
    save_actuator(PAPER, folder / "paper.toml", "the paper's strip, recomputed values")
    drive = PiecewiseLinear.step(4.0)
    engine = chosen_engine(None, linear=PAPER.material.model.linear)
    response = simulate(PAPER, drive, sample_times(300.0), beam="static", engine=engine)
    response.write_csv(folder / "step.csv", energy=True)
    save(response.figure(), folder / "step.png")
    yield f"2  4 V step for 300 s, solved by {engine} -> {folder / 'step.csv'}, {folder / 'step.png'}"
    yield response.summary()
    differences = check(response, tip="free", beam="static")
    others = "the exact solver and " if engine == "ngspice" else ""
    yield f"3  checked against {others}the closed forms"
    yield checked.summary(differences)
    require_agreement(differences)
    square = simulate(PAPER, PiecewiseLinear.square(-4.0, 4.0, 60.0, 300.0), sample_times(300.0), engine=engine)
    save(square.figure(), folder / "square.png")
    yield f"4  square wave, dynamic beam -> {folder / 'square.png'}"
    write_text(folder / "measured.csv", measured(response))
    yield f"5  the step as an instrument would record it, with noise and rest -> {folder / 'measured.csv'}"
    result = identify(read_record(folder / "measured.csv", onset="first-level"), base=PAPER, engine=engine)
    write_actuator(result, folder / "fitted.toml")
    write_json(folder / "fit.json", result.to_dict())
    save(result.figure(), folder / "fit.png")
    yield f"6  identified from it -> {folder / 'fitted.toml'}, {folder / 'fit.json'}, {folder / 'fit.png'}"
    yield result.summary()
    write_text(folder / "strip.cir", deck(response.netlist, drive, 300.0, PAPER))
    write_text(folder / "strip.lib", library(PAPER))
    yield f"7  for plain SPICE -> {folder / 'strip.cir'} (ngspice -b runs it), {folder / 'strip.lib'}"
    write_page(demo_page(folder, response, square, result), folder / PAGE)
    yield f"8  the pictures, what they mean and what to do next -> {folder / PAGE}: open it in a browser"
    yield f"next: {next_commands(folder)[0][1]}"


def measured(response: Response) -> str:
    """Return the CSV file that a potentiostat and a camera would write of ``response``: with noise, and a rest."""
    random = np.random.default_rng(20190401)
    rest = np.arange(-_REST, 0.0, 0.5)
    time = np.concatenate([rest, response.time]) + _REST
    columns = []
    for values, start in ((response.voltage, 0.0), (response.current, 0.0), (response.displacement, _REST_POSITION)):
        noise = 0.0 if values is response.voltage else _NOISE * np.abs(values).max()
        clean = np.concatenate([np.zeros(len(rest)), values]) + start
        columns.append(clean + noise * random.standard_normal(len(time)))
    rows = ["time_s,voltage_V,current_mA,displacement_mm"]
    rows += [f"{t:.2f},{u:.4f},{1e3 * i:.5f},{1e3 * y:.5f}" for t, u, i, y in zip(time, *columns, strict=True)]
    return "\n".join(rows) + "\n"
