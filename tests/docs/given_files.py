"""The files that the pages' commands read: a page names them after ``% given:``; each is made from a seed."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import ilg_circuit as ilg
from ilg_circuit.arrays import Array
from ilg_circuit.identification.shape import bent_line, curved_line
from ilg_circuit.strip.sensing import Sensing

TIME = np.arange(-4.0, 56.0, 0.25)
ON = TIME >= 0


@cache
def _columns(volts: float, seed: int, nonlinear: bool = False) -> Array:
    """Time, voltage, current [mA] and displacement [mm] of a step, (n, 4)."""
    random = np.random.default_rng(seed)
    table = np.zeros((TIME.size, 4))
    table[:, 0] = TIME
    run = ilg.simulate("paper", f"step:{volts}V", times=TIME[ON], beam="static", engine="exact")
    leak = 0.8 / 600 * np.sinh(volts / 0.8) - volts / 600 if nonlinear else 0.0
    table[ON, 1:] = np.column_stack([run.voltage, 1e3 * (run.current + leak), 1e3 * run.displacement])
    table[:, 2:] += [0.2, 0.004] * random.normal(size=(TIME.size, 2))
    return table


def _write(path: Path, header: str, table: Array, form: str = "%.5g", delimiter: str = ",") -> None:
    np.savetxt(path, table, form, delimiter, header=header, comments="")


def _record(path: Path, volts: float, seed: int, motion: bool = False, nonlinear: bool = False) -> None:
    header = "time_s,voltage_V,current_mA" + ",displacement_mm" * motion
    every = 1 if motion or nonlinear else 2
    _write(path, header, _columns(volts, seed, nonlinear)[::every, : 3 + motion])


def _spectrum(path: Path) -> None:
    clean = ilg.impedance("paper", "5 mHz", "1 kHz", engine="exact", beam="static")
    parts = np.column_stack([clean.frequency, clean.impedance.real, clean.impedance.imag])
    parts[:, 1:] *= 1 + 0.003 * np.random.default_rng(5).normal(size=(len(parts), 2))
    _write(path, "frequency_Hz,re_ohm,im_ohm", parts)


def _piece(path: Path, length: float) -> None:
    """The spectrum of a ``length`` [m] of the paper's strip with sheets of 2 ohm per square, both added."""
    f, r = np.geomspace(1e-3, 100, 41), 2 / 5e-3
    y = (1 / 666.667 + 1 / (19.43635 + 1 / (2j * np.pi * f * 0.35))) / 35e-3
    z = np.sqrt(r / y) / np.tanh(np.sqrt(r * y) * length)
    noise = np.random.default_rng(11).normal(size=(2, len(f)))
    parts = np.column_stack([f, z.real, z.imag])
    parts[:, 1:] += 2e-3 * np.abs(z)[:, None] * noise.T
    _write(path, "frequency_Hz,re_ohm,im_ohm", parts)


def _camera(path: Path) -> None:
    """What a camera sees of `current.csv`: pixels of 42 micrometres, its clock 0.37 s late."""
    table = _columns(4.0, 1)[::2]
    _write(path, "time_s,x_px", np.column_stack([table[:, 0] + 0.37, table[:, 3] / 0.042]))


def _export(path: Path) -> None:
    rows = "\n".join(f"{t:.2f};{u:.3f};{i:.4f}".replace(".", ",") for t, u, i, _ in _columns(4.0, 1)[::2])
    path.write_text(f"Exported by a program\nElapsed;Potential applied;Cell current\n{rows}\n")


def _pulled(path: Path, power: float) -> None:
    stretch = np.linspace(1.0, 1.8, 17)
    stress = 2.6 * (stretch - stretch**-power) * (1 + 0.004 * np.random.default_rng(6).normal(size=17))
    _write(path, "stretch,stress_kPa", np.column_stack([stretch, stress]))


def _marks(path: Path, frequency: float | None, resistance: float) -> None:
    """Six marks on the paper's strip with sheets of ``resistance`` [ohm]: at rest under a voltage, or under a sine."""
    s, noise = np.linspace(5e-3, 30e-3, 6), np.random.default_rng(10)
    zero = 1 / 666.667
    omega = 0.0 if frequency is None else 2j * np.pi * frequency
    square = resistance / 5e-3 * (zero + 0.35 * omega / (1 + 19.43635 * 0.35 * omega)) / 35e-3 * 30e-3**2
    if frequency is None:
        t = np.append(np.arange(-5.0, 0.0), np.arange(280.0, 300.0))
        ends = bent_line(s, 30e-3, 25.0, np.real(square))
        z = np.where((t < 0)[:, None], s, ends)
    else:
        t = np.arange(0.0, 20.0, 0.2)
        turned = np.exp(omega * t)[:, None]
        z = s + 1j * np.real(10 * curved_line(s, 30e-3, square) * turned)
    columns = 1e3 * np.stack([z.real, z.imag], axis=2).reshape(len(t), 12) + 0.01 * noise.normal(size=(len(t), 12))
    header = ",".join(f"x{k}_mm,y{k}_mm" for k in range(1, 7))
    _write(path, f"time_s,{header}", np.column_stack([t, columns]))


def _fitted(path: Path) -> None:
    table = _columns(4.0, 1) * [1.0, 1.0, 1e-3, 1e-3]
    names = ("time", "voltage", "current", "displacement")
    arrays = dict(zip(names, table.T, strict=True))
    ilg.identify(strip="paper", model="rc", onset="0 s", engine="exact", **arrays).save(path)


def _strip(path: Path) -> None:
    sizes = '[geometry]\nlength = "35 mm"\nfree_length = "30 mm"\nwidth = "5 mm"\nthickness = "0.5 mm"\n'
    path.write_text(f"{sizes}[material]\nyoungs_modulus = '7.6 kPa'\n")


def _moved(path: Path) -> None:
    """A moved tip, and what a law of sensing of its own makes of it."""
    t = np.arange(0.0, 60.0, 0.2)
    strip = replace(ilg.PAPER, sensing=Sensing(instantaneous=3.0, gain_1=-2.0, time_1=4.0))
    motion = (t, 1e-3 * np.sin(0.6 * t) * (t < 40))
    found = ilg.sense(strip, motion, times=t, engine="exact")
    voltage = 1e3 * found.voltage + 0.01 * np.random.default_rng(12).normal(size=len(t))
    _write(path, "time_s,displacement_mm,voltage_mV", np.column_stack([t, 1e3 * found.displacement, voltage]))


MAKERS = {
    "step.csv": lambda path: _record(path, 4.0, 1, motion=True),
    "other.csv": lambda path: _record(path, 2.0, 2, motion=True),
    "current.csv": lambda path: _record(path, 4.0, 1),
    "1V.csv": lambda path: _record(path, 1.0, 3),
    "minus2V.csv": lambda path: _record(path, -2.0, 4),
    "monday.csv": lambda path: _record(path, 2.0, 6),
    "friday.csv": lambda path: _record(path, 2.0, 7),
    "sinh_1V.csv": lambda path: _record(path, 1.0, 8, nonlinear=True),
    "sinh_2V.csv": lambda path: _record(path, 2.0, 9, nonlinear=True),
    "spectrum.csv": _spectrum,
    "eis_20mm.csv": lambda path: _piece(path, 20e-3),
    "eis_35mm.csv": lambda path: _piece(path, 35e-3),
    "camera.csv": _camera,
    "export.csv": _export,
    "pull.csv": lambda path: _pulled(path, 2),
    "sheet.csv": lambda path: _pulled(path, 3),
    "inflate.csv": lambda path: _pulled(path, 5),
    "w.csv": lambda path: path.write_text("0,2.5\n2.5,0\n"),
    "designs.csv": lambda path: path.write_text("thickness_mm,free_length_mm\n0.4,30\n0.5,30\n0.6,25\n"),
    "marks.csv": lambda path: _marks(path, None, 300.0),
    "sine.csv": lambda path: _marks(path, 0.1, 10.0),
    "moved.csv": _moved,
    "fitted.toml": _fitted,
    "strip.toml": _strip,
    "four.toml": lambda path: (
        ilg.load("paper")
        .with_(
            electrodes={
                "sheet_resistance_1": 0.25,
                "sheet_resistance_2": 0.25,
                "segments_1": 4,
                "segments_2": 4,
                "contact": "each",
                "cells": 8,
            }
        )
        .save(path)
    ),
    "bending.toml": lambda path: ilg.load("paper").with_(kind="charge", instantaneous="130 nm/V").save(path),
}
