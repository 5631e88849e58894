"""The tab with a strip's sliders: its response and its impedance, solved by the exact engine while a slider moves."""

from __future__ import annotations

from typing import Any

import numpy as np
import panel as pn

import ilg_circuit as ilg

from ..browser.sliders import Slider
from ..errors import IlgError, visible
from ..measurements.spectrum import Spectrum
from ..strip.actuator import Actuator
from .answers import box, noting
from .curves import BEFORE, MEASURED, NOW, OTHER, Curves, Panel
from .live import Live
from .look import button, card, choice, field, parts, shown, tabs
from .moved import ENDS, changes, movable, place_of, typed, value_at
from .moved import shown as in_unit
from .session import Session
from .tasks import read

_WAVES = {"displacement": "m", "force": "N", "current": "A", "charge": "C", "voltage": "V"}
_DRIVES = ["step:4V", "square:4V,30s", "square:-2V..2V,30s", "sine:2V,0.1Hz", "triangle:4V,30s", "cv:-1V..1V,50mV/s"]
#: Before the name of a measured file, whose voltage is the drive.
_FILE = "measured: "
#: Drives that take the exact engine seconds: they are solved when asked for.
_SLOW = ("chirp", "multisine", "repeat")
_OF_NOW = "Takes any form of the command simulate: step:4V, square:4V,30s, sine:2V,0.1Hz, file:drive.csv, ..."


class StripTab:
    """The tab: ``view`` is what Panel shows."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.moving = Moving(session)
        self.drive = pn.widgets.AutocompleteInput(
            label="Drive",
            value="step:4V",
            options=list(_DRIVES),
            restrict=False,
            min_characters=0,
            description=_OF_NOW,
            sizing_mode="stretch_width",
        )
        self.duration = field("Duration", "300 s")
        self.tip = choice("Tip", {"free": "free", "clamped (blocked force)": "clamped"}, "free")
        self.load = field("Load", placeholder="mass=1g")
        self.low, self.high, self.bias = field("From", "1 mHz"), field("To", "1 kHz"), field("Bias", "0 V")
        self.response = Curves(
            [Panel("time", name, ("s", unit), ("time", name)) for name, unit in _WAVES.items()], "response"
        )
        self.spectrum = Curves(
            [
                Panel("re", "minus_im", ("ohm", "ohm"), ("Re Z", "\N{MINUS SIGN}Im Z"), equal=True),
                Panel("frequency", "modulus", ("Hz", "ohm"), ("frequency", "|Z|"), logarithmic="xy"),
                Panel("frequency", "phase", ("Hz", "deg"), ("frequency", "phase"), logarithmic="x"),
            ],
            "impedance",
        )
        self.told, self.numbers, self.compared = shown(), shown(), shown()
        self.told_of_spectrum = shown()
        self.ngspice = button("Solve with ngspice, too", self.solve)
        self.live = Live(_response, self._answered, session.soon)
        self.live_spectrum = Live(_spectrum, self._answered_spectrum, session.soon)
        over_time = pn.Column(
            pn.FlexBox(*(_narrow(w) for w in (self.drive, self.duration, self.tip, self.load)), flex_wrap="wrap"),
            self.told,
            self.response.view,
            self.ngspice,
            self.compared,
            self.numbers,
            sizing_mode="stretch_width",
        )
        over_frequency = pn.Column(
            pn.FlexBox(*(_narrow(w) for w in (self.low, self.high, self.bias)), flex_wrap="wrap"),
            self.told_of_spectrum,
            self.spectrum.view,
            sizing_mode="stretch_width",
        )
        both = tabs(("Response over time", over_time), ("Impedance", over_frequency))
        self.view = parts([self.moving.view], [both])
        for widget in (self.drive, self.duration, self.tip, self.load):
            widget.param.watch(lambda _event: self._again(), "value")
        for widget in (self.low, self.high, self.bias):
            widget.param.watch(lambda _event: self._again(), "value")
        session.on("base", self._again)
        session.on("strip", self._moved)
        session.on("fit", self._measured)
        session.on("files", self._measured)
        session.on("files", self._offer)
        session.on("work", self._working)
        self._again()

    def asked(self) -> tuple[str, str, str, str]:
        """Return drive, duration, tip and load of the run; the drive of a measured file is ``file:`` and its path."""
        drive = self.drive.value.strip()
        for each in self.session.sources:
            if drive == f"{_FILE}{each.name}":
                drive = f"file:{each.path}"
        return drive, self.duration.value.strip(), self.tip.value, self.load.value.strip()

    def _offer(self) -> None:
        """Offer the voltages of measured files as drives."""
        self.drive.options = [*_DRIVES, *(f"{_FILE}{each.name}" for each in self.session.sources)]

    def _moved(self) -> None:
        """Compute the strip as it is now, and as it was where that has not been drawn."""
        run, band = self.asked(), (self.low.value, self.high.value, self.bias.value)
        base = self.session.base if BEFORE.name not in self.response.values else None
        if self.session.strip is self.session.base:
            base = None
        slow = run[0].partition(":")[0] in _SLOW
        if slow or not self.session.strip.material.model.linear:
            self.live.forget()
            why = "This drive takes seconds" if slow else "A nonlinear strip is solved by ngspice alone"
            self.told.object = box("note", f"{why}: press Solve with ngspice.")
            for curve in (NOW, OTHER):
                self.response.set(curve, None)
            self.session.run, self.numbers.object = None, ""
            self.response.draw()
        else:
            self.live.want(self.session.strip, base, *run)
        self.live_spectrum.want(self.session.strip, base, *band)

    def _again(self) -> None:
        """Forget what was drawn for another drive or strip."""
        for curve in (BEFORE, NOW, OTHER):
            self.response.set(curve, None)
            self.spectrum.set(curve, None)
        self.response.set(MEASURED, None)
        self.session.run = None
        self.compared.object = ""
        self._moved()

    def _answered(self, found: Any) -> None:
        if isinstance(found, IlgError):
            self.told.object = box("error", str(found))
            return
        now, before = found
        self.session.run = now
        self.session.tell("run")
        self.told.object = box("warning", *now.warnings)
        self.response.set(NOW, _columns(now))
        self.response.set(MEASURED, _compared(now))
        self.response.set(OTHER, None)
        self.compared.object = ""
        if before is not None:
            self.response.set(BEFORE, _columns(before))
        elif self.session.strip is self.session.base:
            self.response.set(BEFORE, None)
        self.response.draw()
        self.numbers.object = f"<pre>{visible_lines(now.summary())}</pre>"

    def _answered_spectrum(self, found: Any) -> None:
        if isinstance(found, IlgError):
            self.told_of_spectrum.object = box("error", str(found))
            return
        now, before = found
        self.told_of_spectrum.object = box("warning", *getattr(now, "warnings", ()))
        self.spectrum.set(NOW, _points(now.frequency, now.impedance))
        if before is not None:
            self.spectrum.set(BEFORE, _points(before.frequency, before.impedance))
        elif self.session.strip is self.session.base:
            self.spectrum.set(BEFORE, None)
        self.spectrum.draw()

    def _measured(self) -> None:
        """Draw a measured spectrum beside the strip's."""
        data: Any = self.session.fit.result if self.session.fit is not None else None
        there = {each.name for each in self.session.sources}
        self.spectrum.set(MEASURED, None)
        for each in self.session.sources:
            if data is None or each.name not in there:
                break
            try:
                found = read(each, {})
            except IlgError:
                continue
            if isinstance(found, Spectrum):
                self.spectrum.set(MEASURED, _points(found.frequency, found.impedance))
        self.spectrum.draw()

    def _working(self) -> None:
        self.ngspice.disabled = self.session.work is not None

    def solve(self) -> None:
        """Have ngspice solve the strip as it is now."""
        drive, duration, tip, load = self.asked()
        arguments = {"strip": self.session.strip, "drive": drive, "duration": duration, "tip": tip, "load": load}
        asked = self.session.strip, self.asked()
        self.session.start(
            "Solving with ngspice", "run", arguments, lambda run: self._solved(run, asked), self._unsolved
        )

    def _solved(self, run: Any, asked: tuple[Actuator, tuple[str, str, str, str]]) -> None:
        """Draw what ngspice says, unless the strip or its run has changed since it was ``asked``."""
        if asked != (self.session.strip, self.asked()):
            self.compared.object = box("note", "ngspice solved the strip as it was; press Solve with ngspice again.")
            return
        self.response.set(OTHER, _columns(run))
        now = self.session.run
        if now is not None and now.actuator == run.actuator and len(now.time) == len(run.time):
            off = max(_difference(now.waveforms[name], run.waveforms[name]) for name in _WAVES)
            line = f"ngspice and the exact engine differ by at most {off:.1e} of each waveform's largest value."
        else:
            self.session.run = run
            self.session.tell("run")
            self.told.object = box("warning", *run.warnings)
            self.numbers.object = f"<pre>{visible_lines(run.summary())}</pre>"
            line = f"Solved by ngspice, estimated error {run.error:.1e} of each waveform's largest value."
        self.compared.object = box("good", line)
        self.response.draw()

    def _unsolved(self, line: str) -> None:
        self.compared.object = box("error", line)

    def close(self) -> None:
        """Compute nothing more."""
        self.live.close()
        self.live_spectrum.close()


class Moving:
    """The sliders of the session's strip, each with a field for its value; ``view`` is what Panel shows."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.sliders: list[Slider] = []
        self.values: dict[str, float] = {}
        self.widgets: dict[str, tuple[Any, Any]] = {}
        self.title, self.refused = shown(), shown()
        self.rows = pn.Column(sizing_mode="stretch_width")
        self.view = pn.Column(
            self.title,
            button("Back to the strip as it was", self.reset),
            self.refused,
            self.rows,
            sizing_mode="stretch_width",
        )
        self._busy = False
        session.on("base", self._made)
        self._made()

    def _made(self) -> None:
        """Make the sliders of another strip."""
        base = self.session.base
        self.sliders = movable(base)
        self.values = {s.name: s.value for s in self.sliders}
        self.widgets = {}
        name = f"<b>{visible_lines(base.name)}</b>, {visible_lines(self.session.origin)}"
        self.title.object = f"<p>Strip: {name}; model {base.material.model.name}</p>"
        self.refused.object = ""
        groups: dict[str, list[Any]] = {}
        for slider in self.sliders:
            groups.setdefault(slider.group, []).append(self._row(slider))
        self.rows[:] = [card(title, *rows, open=True) for title, rows in groups.items()]

    def _row(self, slider: Slider) -> Any:
        bar = pn.widgets.IntSlider(
            label=slider.label,
            start=-ENDS,
            end=ENDS,
            value=0,
            show_value=False,
            sizing_mode="stretch_width",
            bar_color="#1f77b4",
        )
        text = pn.widgets.TextInput(label="", value=in_unit(slider, slider.value), width=125, align="end")
        bar.param.watch(lambda event: self._slid(slider, event.new), "value")
        text.param.watch(lambda event: self._typed(slider, event.new), "value")
        self.widgets[slider.name] = bar, text
        return pn.Row(bar, text, sizing_mode="stretch_width")

    def _slid(self, slider: Slider, place: float) -> None:
        if not self._busy:
            self._set(slider, value_at(slider, place))

    def _typed(self, slider: Slider, text: str) -> None:
        if self._busy:
            return
        try:
            self._set(slider, typed(slider, text))
        except IlgError as error:
            self.refused.object = box("error", str(error))

    def _set(self, slider: Slider, value: float) -> None:
        """Take a value, show it in slider and field, and move the strip."""
        self.values[slider.name] = value
        bar, text = self.widgets[slider.name]
        self._busy = True
        try:
            bar.value, text.value = place_of(slider, value), in_unit(slider, value)
        finally:
            self._busy = False
        base = self.session.base
        moved = changes(self.sliders, self.values)
        try:
            with noting() as remarks:
                strip = base.with_(**moved) if moved else base
        except IlgError as error:
            self.refused.object = box("error", str(error))
            return
        self.refused.object = box("warning", *remarks)
        self.session.move(strip)

    def reset(self) -> None:
        """Put all sliders back."""
        self.session.take_strip(self.session.base, self.session.origin)


def visible_lines(text: str) -> str:
    """Return text for HTML, its lines kept."""
    from html import escape

    return escape("\n".join(map(visible, text.split("\n"))))


def _narrow(widget: Any) -> Any:
    widget.styles = {"flex": "1 1 150px"}
    return widget


def _response(strip: Actuator, base: Actuator | None, drive: str, duration: str, tip: str, load: str) -> Any:
    """Return the response of a strip, and of the one that it was."""
    how: dict[str, Any] = {"tip": tip, "load": load or None, "engine": "exact"}
    measured = drive.startswith("file:")
    now = ilg.simulate(strip, drive, duration, compare=measured, **how)
    return now, None if base is None else ilg.simulate(base, drive, duration, **how)


def _spectrum(strip: Actuator, base: Actuator | None, low: str, high: str, bias: str) -> Any:
    """Return the impedance of a strip, and of the one that it was."""
    return tuple(None if s is None else ilg.impedance(s, low, high, bias=bias, engine="exact") for s in (strip, base))


def _columns(run: Any) -> dict[str, Any]:
    return {"time": run.time} | {name: run.waveforms[name] for name in _WAVES}


def _compared(run: Any) -> dict[str, Any] | None:
    """Return what was measured under the drive of a run, over time; None where it is no measured one."""
    if not run.compared:
        return None
    return {"time": run.compared[0].time} | {
        each.quantity: each.measured for each in run.compared if len(each.time) == len(run.compared[0].time)
    }


def _points(frequency: Any, impedance: Any) -> dict[str, Any]:
    return {
        "frequency": frequency,
        "re": impedance.real,
        "minus_im": -impedance.imag,
        "modulus": np.abs(impedance),
        "phase": np.degrees(np.angle(impedance)),
    }


def _difference(one: Any, other: Any) -> float:
    """Return the largest difference, relative to the largest value; 0 of what is not known or zero."""
    largest = float(np.nanmax(np.abs(one), initial=0.0))
    return float(np.nanmax(np.abs(one - other), initial=0.0)) / largest if largest else 0.0
