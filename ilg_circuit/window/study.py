"""The tabs that vary the strip: a sweep with its map, and a design that meets requirements."""

from __future__ import annotations

from typing import Any

import panel as pn

from ..study.outputs import OUTPUTS
from .answers import Answer, box
from .download import Download
from .look import button, choice, field, lines, parts, shown
from .moved import key, movable
from .session import Session, texts

#: What is varied at first, and the ends of its range relative to the strip's value.
_FIRST, _ENDS = ("thickness", "width"), (0.5, 2.0)
_NOTHING = "(nothing)"
#: Parameters of the drive that can be varied, and an example of each end.
_OF_DRIVE = {"voltage": ("1 V", "5 V"), "period": ("10 s", "60 s"), "load_mass": ("0 g", "1 g")}


class Ranges:
    """Rows of what is varied, between which values; ``view`` is what Panel shows."""

    def __init__(self, session: Session, rows: int, points: int | None) -> None:
        self.session, self.points = session, points
        self.rows: list[tuple[Any, Any, Any, Any]] = []
        for k in range(rows):
            name = choice("Vary" if k == 0 else "and", [_NOTHING], styles={"flex": "2 1 105px"})
            low, high = field("from"), field("to")
            count = pn.widgets.IntInput(label="points", value=points or 0, start=2, end=200, width=62)
            for widget in (low, high):
                widget.styles = {"flex": "1 1 78px"}
            for widget in (name, low, high, count):
                widget.margin = (5, 4)
            name.param.watch(lambda event, k=k: self._chosen(k, event.new), "value")
            self.rows.append((name, low, high, count))
        shown_parts = [row if points else row[:3] for row in self.rows]
        self.view = pn.Column(
            *(pn.FlexBox(*row, flex_wrap="wrap", sizing_mode="stretch_width") for row in shown_parts),
            sizing_mode="stretch_width",
        )
        session.on("base", self._offered)
        self._offered()

    def _offered(self) -> None:
        """Offer what the session's strip has, with ranges about its values."""
        self.known = {
            key(s): tuple(f"{s.value * end / s.scale:.4g} {s.unit}".strip() for end in _ENDS)
            for s in movable(self.session.base)
        } | _OF_DRIVE
        for k, (name, *_) in enumerate(self.rows):
            first = _FIRST[k] if k < len(_FIRST) else _NOTHING
            like = next((n for n in self.known if n.endswith(first)), _NOTHING)  # the thickness of a layer
            now = name.value if name.value in self.known else first if first in self.known else like
            changed = name.value != now
            name.param.update(options=[_NOTHING, *self.known], value=now)
            if not changed:
                self._chosen(k, now)

    def _chosen(self, k: int, name: str) -> None:
        _, low, high, _ = self.rows[k]
        low.value, high.value = self.known.get(name, ("", ""))

    @property
    def texts(self) -> list[str]:
        """The ranges as `ilg.sweep` and `ilg.design` take them."""
        found = []
        for name, low, high, count in self.rows:
            if name.value != _NOTHING:
                ends = [_plain(each.value) for each in (low, high) if each.value.strip()]
                found.append(f"{name.value}={':'.join([*ends, *([str(count.value)] if self.points else [])])}")
        return found


class Drive:
    """The drive of the runs; ``view`` is what Panel shows."""

    def __init__(self) -> None:
        self.drive, self.duration = field("Drive", "step:4V", help="As in the tab Strip."), field("Duration", "300 s")
        self.view = pn.Row(self.drive, self.duration, sizing_mode="stretch_width")


class SweepTab:
    """The tab of sweeps."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.ranges, self.drive = Ranges(session, 2, 9), Drive()
        self.outputs = pn.widgets.MultiChoice(
            label="Outputs", options=list(OUTPUTS), value=["displacement_final", "energy"], sizing_mode="stretch_width"
        )
        self.go = button("Sweep", self.start, first=True)
        self.save = Download("Save the table (CSV)", "sweep.csv", lambda path: path.write_text(self._table, "utf-8"))
        self.save.view.visible = False
        self._table = ""
        self.answer = shown(
            box(
                "note",
                "Two parameters make a map, one a curve. What is not varied is as the sliders of the tab Strip stand.",
            )
        )
        self.view = parts([self.ranges.view, self.drive.view, self.outputs, self.go, self.save.view], [self.answer])
        session.on("work", lambda: setattr(self.go, "disabled", session.work is not None))

    def start(self) -> None:
        """Have the sweep solved."""
        arguments = {
            "strip": self.session.strip,
            "drive": self.drive.drive.value.strip(),
            "duration": self.drive.duration.value,
            "vary": self.ranges.texts,
            "outputs": list(self.outputs.value),
        }
        self.answer.object = box("note", "Solving. The line above says how far it is; Stop ends it.")
        self.session.start("Sweep", "sweep", arguments, self._done, self._failed)

    def _done(self, answer: Answer) -> None:
        self.answer.object, self._table = answer.html, str(answer.made)
        self.save.view.visible = True

    def _failed(self, line: str) -> None:
        self.answer.object = box("error", line)


class DesignTab:
    """The tab of designs."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.ranges, self.drive = Ranges(session, 3, None), Drive()
        self.require = lines(
            "Requirements, one a line",
            "displacement_final>=4mm\nrelative_deflection<=0.2",
            rows=3,
            help="An output, >= or <=, a value: settling_time<=20s. valid stands for all limits of the model.",
        )
        self.sense = choice("Best is", {"the lowest": "minimise", "the highest": "maximise"}, "minimise")
        self.aim = choice("Quantity", list(OUTPUTS), "energy")
        self.go = button("Find the strip", self.start, first=True)
        self.use = button("Use this strip in all tabs", self._use)
        self.use.visible = False
        self.found: Any = None
        self.answer = shown(
            box(
                "note", "Finds the strip, within the ranges, that meets the requirements best, and says what limits it."
            )
        )
        self.view = parts(
            [
                self.ranges.view,
                self.drive.view,
                self.require,
                pn.Row(self.sense, self.aim, sizing_mode="stretch_width"),
                self.go,
                self.use,
            ],
            [self.answer],
        )
        session.on("work", lambda: setattr(self.go, "disabled", session.work is not None))

    def start(self) -> None:
        """Have the design found."""
        arguments = {
            "strip": self.session.strip,
            "drive": self.drive.drive.value.strip(),
            "duration": self.drive.duration.value,
            "vary": self.ranges.texts,
            "require": texts(self.require.value),
            "aim": {self.sense.value: self.aim.value},
        }
        self.use.visible = False
        self.answer.object = box("note", "Searching. The line above says how far it is; Stop ends it.")
        self.session.start("Design", "design", arguments, self._done, self._failed)

    def _done(self, answer: Answer) -> None:
        self.answer.object, self.found = answer.html, answer.made
        self.use.visible = self.found is not None

    def _use(self) -> None:
        self.session.take_strip(self.found, "designed")

    def _failed(self, line: str) -> None:
        self.answer.object = box("error", line)


def _plain(text: str) -> str:
    """Return a value as the parser of ranges takes it: units as they are typed on a keyboard."""
    signs = {"\N{GREEK CAPITAL LETTER OMEGA}": "ohm", "\N{NO-BREAK SPACE}": " ", "²": "^2", "³": "^3"}
    for sign, written in signs.items():
        text = text.replace(sign, written)
    return text.strip()
