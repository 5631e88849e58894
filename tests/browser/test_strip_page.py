"""The page of a strip, driven in a browser: its numbers are those of `simulate`, for every electrical model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from every_model import MODELS, strip_of

import ilg_circuit as ilg
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.strip.actuator import PAPER, Actuator, Mounting
from ilg_circuit.strip.elements import lumped_elements

DURATION = 20.0
DRIVES = ("step:3V", "square:-1V..2V,8s,0.4", "sine:2V,0.1Hz", "triangle:-2V..1V,8s")
#: Places of sliders, those that a model has.
MOVED = {
    **{"width": 30, "thickness": -20, "dc_resistivity": -40, "youngs_modulus": 50, "permittivity": 15},
    **{"dynamic_resistivity": 25, "permittivity_2": -10, "emission_voltage": 5, "inductance": -30},
}
#: The page's bound on its differences, relative to the largest value.
CLOSE = 1e-5


def differences(strip: Actuator, drive: str, found: dict[str, np.ndarray], beam: str | None = None) -> dict[str, float]:
    """How far a page's curves are from `simulate`, relative to the largest value, at times of its own."""
    port = lumped_elements(strip).port
    engine = "exact" if port.linear and port.ladder is None else "ngspice"
    time = found["time"]
    edges = parse_drive(drive, DURATION).breakpoints(DURATION)
    at = np.unique(np.linspace(0, len(time) - 1, 60).astype(int))
    at = at[[np.abs(edges - time[k]).min(initial=1.0) > 1e-3 * DURATION for k in at]]
    at = at[time[at] < DURATION * (1 - 1e-3)]
    assert len(at) > 30
    how: dict[str, Any] = {"engine": engine, "beam": beam}
    free = ilg.simulate(strip, drive, times=time[at], **how)
    waves = {"voltage": free.voltage, "current": free.current, "charge": free.charge}
    if strip.coupling is not None:
        waves["displacement"] = free.displacement
        waves["force"] = ilg.simulate(strip, drive, times=time[at], tip="clamped", **how).force
    off = {name: float(np.abs(found[name][at] - wave).max() / np.abs(wave).max()) for name, wave in waves.items()}
    native = ilg.impedance(strip, frequency=found["frequency"], engine="exact", beam=beam).impedance
    off["impedance"] = float(np.abs((found["re"] + 1j * found["im"] - native) / native).max())
    return off


@pytest.mark.parametrize("model", MODELS)
def test_numbers_of_every_model_with_its_sliders_moved(model: str, open_page: Callable[..., Any]) -> None:
    strip = strip_of(model, 3.0)
    ladder = lumped_elements(strip).port.ladder is not None
    if ladder and "+" in model:  # the plain ones have moved
        strip = replace(strip, coupling=None)
    drive = DRIVES[MODELS.index(model) % (1 if ladder else len(DRIVES))]
    opened = open_page(strip, drive, DURATION)
    names = {slider["name"] for slider in opened.ask("Solver.REST = 0; return strip.data.sliders")}
    moved = {name: place for name, place in MOVED.items() if name in names}
    for name, place in moved.items():
        opened.slide(name, place)
    opened.settled()
    values, was = (opened.ask(f"return {what}") for what in ("strip.state.values", "strip.data.sliders"))
    assert {s["name"] for s in was if values[s["name"]] != s["value"]} == set(moved)
    assert len(moved) >= 4
    off = differences(strip.with_(**{name: values[name] for name in moved}), drive, opened.result)
    assert max(off.values()) < CLOSE, off


@pytest.mark.parametrize("how", ["hanging", "static"])
def test_numbers_of_other_mountings(how: str, open_page: Callable[..., Any]) -> None:
    strip = replace(PAPER, mounting=Mounting("hanging")) if how == "hanging" else PAPER
    strip = strip.with_(youngs_modulus=9e5)
    beam = "static" if how == "static" else None
    opened = open_page(strip, "square:3V,15s", DURATION, beam=beam)
    opened.slide("thickness", 20)
    opened.settled()
    values = opened.ask("return strip.state.values")
    off = differences(strip.with_(thickness=values["thickness"]), "square:3V,15s", opened.result, beam)
    assert max(off.values()) < CLOSE, off
    if how == "hanging":
        opened.slide("density", 100)
        assert "more than 4 times as heavy" in opened.message
        assert opened.ask("return strip.state.values.density") == 1250.0


def test_a_moved_ladder_is_told_beside_what_it_changes(open_page: Callable[..., Any]) -> None:
    opened = open_page(strip_of("warburg"), "step:3V", DURATION)
    shown = "return !document.getElementById('ladder').hidden"
    assert not opened.ask(shown)
    opened.slide("diffusion_time", 100)
    assert opened.ask(shown)
    assert "Another diffusion time moves" in opened.ask("return document.getElementById('ladder').textContent")
    opened.slide("diffusion_time", 0)
    assert not opened.ask(shown)
