"""The tab in which measurements are opened, their columns chosen, and a strip fitted to them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import panel as pn

from ..errors import IlgError, visible, written
from ..fit.estimate import Method
from ..front.heads import Head, head
from ..strip.models import model_names
from .answers import SPELLING, Answer, box, noting, table
from .look import button, card, choice, field, parts, shown
from .session import Session
from .tasks import Source, read

#: Kinds of files whose columns can be chosen: quantity -> SI unit.
_QUANTITIES = {
    "record over time": {"time": "s", "voltage": "V", "current": "A", "displacement": "m"},
    "impedance spectrum": {"frequency": "Hz", "re": "ohm", "im": "ohm"},
}
#: Sizes of the strip that is measured: argument of `ilg.identify` -> (title, example).
_SIZES = {
    "length": ("Length", "35 mm"),
    "free_length": ("Free length", "30 mm"),
    "width": ("Width", "5 mm"),
    "thickness": ("Thickness", "0.5 mm"),
    "youngs_modulus": ("Young's modulus", "7.6 kPa"),
}
#: Further arguments of `ilg.identify`: (title, example, help).
_MORE = {
    "onset": (
        "Onset",
        "4 s",
        "When the voltage began: a time, last-rest or first-level. Found in the data if left out.",
    ),
    "until": ("Until", "60 s", "Time since the onset up to which records are fitted."),
    "electrode_resistance": ("Electrode resistance", "2 ohm", "Re, held at this value; or fit, for nonlinear models."),
    "bias": ("Bias of spectra", "1 V", "Constant voltage under which impedances were measured."),
    "drive": ("Drive of a displacement alone", "step:2V", "The voltage, for files that hold no voltage and current."),
    "scale": ("Size of a pixel", "0.042mm/px", "For a camera's positions in pixels."),
    "displacement_delay": ("Delay of the displacement", "0.1 s", "How much later its clock reads; or fit."),
}
_AS_READ = "(as the header says)"
_FIELD = """
.bk-input[type=file] { padding: 1.4rem .8rem !important; border: 2px dashed #8aa4c4 !important; cursor: pointer;
  border-radius: 8px !important; background: #f3f7fc !important; width: 100%; height: auto !important; }
"""
_FIRST = """<p class="note">Drop CSV or instrument files of a step, a waveform or an impedance spectrum anywhere on this
page; a strip's TOML file, too. What is in them appears here. Then press Fit.</p>
<p class="note">Nothing leaves this machine. Without a measurement go on to the tab Strip: it begins with the strip of
the paper.</p>"""


class Measure:
    """The tab: ``view`` is what Panel shows."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.drop = pn.widgets.FileInput(
            multiple=True,
            sizing_mode="stretch_width",
            stylesheets=[_FIELD],
            label="Files: drop them anywhere, or choose them",
        )
        self.drop.param.watch(lambda event: self._dropped(event.new), "value")
        self.example = button("No data at hand? Open an example", session.take_example)
        self.refused = shown()
        self.opened = shown()
        self.keep = pn.widgets.MultiChoice(label="Files that are fitted", visible=False, sizing_mode="stretch_width")
        self.keep.param.watch(lambda event: self._kept(event.new), "value")
        self.sizes = {key: field(title, placeholder=example) for key, (title, example) in _SIZES.items()}
        self.strip_line = shown()
        names = ["auto", *model_names()]
        self.model = choice(
            "Electrical model", names, "auto", "auto: the simplest of those that fit as well as the best."
        )
        self.intervals = choice("Intervals", list(get_args(Method)), "covariance", "How 95 % intervals are computed.")
        self.more = {key: field(title, "", example, text) for key, (title, example, text) in _MORE.items()}
        for key in ("drive", "onset", "scale"):  # which are about the files
            self.more[key].param.watch(lambda _event: self._files(), "value")
        self.fit = button("Fit", self.start, first=True)
        self.columns = Columns(session)
        self.answer = shown(_FIRST)
        self.view = parts(
            [
                self.drop,
                self.example,
                self.refused,
                self.opened,
                self.keep,
                self.columns.view,
                card("The strip that was measured", self.strip_line, *self.sizes.values()),
                self.model,
                self.intervals,
                card("More", *self.more.values()),
                self.fit,
            ],
            [self.answer],
        )
        session.on("files", self._files)
        session.on("work", self._working)
        self._files()

    def _dropped(self, contents: Any) -> None:
        """Take the files that the browser sent."""
        if not contents:
            return
        names, wrong = self.drop.filename, []
        contents, names = (contents, names) if isinstance(contents, list) else ([contents], [names])
        with noting() as remarks:
            for name, content in zip(names, contents, strict=True):
                try:
                    self.session.take(name, content)
                except IlgError as error:
                    wrong.append(str(error))
        self.refused.object = box("error", *wrong) + box("warning", *remarks)

    def _kept(self, names: list[str]) -> None:
        gone = [each.name for each in self.session.sources if each.name not in names]
        if gone:
            self.session.leave_out(gone)

    def _files(self) -> None:
        """Say of every file what was read from it, and show its data."""
        sources = self.session.sources
        names = [each.name for each in sources]
        self.example.visible = not names
        self.keep.param.update(options=names, value=names, visible=bool(names))
        given = self.session.given
        what = f"Its file gives: {visible(given.name)}." if given is not None else ""
        self.strip_line.object = box(
            "note", f"{what} Fields left empty are as in the file, else as in the paper.".strip()
        )
        lines, pictures, unread = [], [], None
        for each in sources:
            found = self._read(each)
            if isinstance(found, str):
                lines.append(box("error", found))
                unread = unread or each.name
            else:
                lines.append(box("good", repr(found).splitlines()[0]))
                lines += [box("warning", line) for line in found.warnings]
                pictures.append(found._repr_html_())
        self.opened.object = "".join(lines)
        self.columns.show(names, unread)
        self.answer.object = "".join(pictures) or _FIRST

    def _read(self, source: Source) -> Any:
        """Return what a file holds, or why it cannot be read."""
        try:
            with written(SPELLING):
                return read(source, self._options())
        except IlgError as error:
            return str(error)

    def _options(self) -> dict[str, str]:
        """Return the fields that are filled, as options of `ilg.identify`."""
        return {key: value for key, w in (self.sizes | self.more).items() if (value := w.value.strip())}

    def _working(self) -> None:
        self.fit.disabled = self.session.work is not None

    def start(self) -> None:
        """Have the files fitted."""
        if not self.session.sources:
            self.answer.object = box("error", "there is nothing to fit; drop a measurement on this page first")
            return
        options = self._options() | {"model": self.model.value}
        arguments = {
            "sources": list(self.session.sources),
            "strip": self.session.given,
            "options": options,
            "intervals": self.intervals.value,
        }
        self.answer.object = box("note", "Fitting. The line above says how far it is; Stop ends it.")
        self.session.start("Fitting", "fit", arguments, self._done, self._failed)

    def _done(self, answer: Answer) -> None:
        self.answer.object = answer.html
        self.session.fit = answer
        fitted: Any = answer.result
        if answer.success:
            names = ", ".join(each.name for each in self.session.sources)
            self.session.take_strip(fitted.actuator, f"fitted to {names}")
        self.session.tell("fit")

    def _failed(self, line: str) -> None:
        self.answer.object = box("error", line)


class Columns:
    """Chooses, for one file, which column is what, and in which unit."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.file = choice("File", [])
        self.kind = choice("It holds a", list(_QUANTITIES))
        self.head = shown()
        self.rows = pn.Column(sizing_mode="stretch_width")
        self.part = field("Measurement number, where there are several", placeholder="1")
        self.read = button("Read with these columns", self.apply)
        self.chosen: dict[str, tuple[Any, Any]] = {}
        self.view = card("Columns and units", self.file, self.kind, self.head, self.rows, self.part, self.read)
        self.view.visible = False
        for widget in (self.file, self.kind):
            widget.param.watch(lambda _event: self._table(), "value")

    def show(self, names: list[str], unread: str | None) -> None:
        """Offer the files, the one that was not understood first."""
        self.view.visible = bool(names)
        now = unread or (self.file.value if self.file.value in names else None) or next(iter(names), None)
        before = self.file.value
        self.file.param.update(options=names, value=now)
        if before == now:
            self._table()
        if unread:
            self.view.collapsed = False

    def _head(self) -> tuple[Path | None, Head]:
        source = next((each for each in self.session.sources if each.name == self.file.value), None)
        if source is None:
            return None, Head((), ())
        return source.path, head(source.path)

    def _table(self) -> None:
        """Show the head of the file, and a list of its titles for each quantity."""
        try:
            path, found = self._head()
        except IlgError as error:
            self.head.object = box("error", str(error))
            self.rows[:] = []
            return
        if path is None:
            return
        self.head.object = table(found.titles, found.rows)
        self.chosen = {}
        rows = []
        for quantity, unit in _QUANTITIES[self.kind.value].items():
            title = choice(quantity, [_AS_READ, *dict.fromkeys(found.titles)])
            given = pn.widgets.TextInput(label=f"in, such as {unit}", width=110)
            self.chosen[quantity] = title, given
            rows.append(pn.Row(title, given, sizing_mode="stretch_width"))
        self.rows[:] = rows

    def apply(self) -> None:
        """Have the file read with what was chosen."""
        titles = {q: t.value for q, (t, _) in self.chosen.items() if t.value != _AS_READ}
        units = {q: u.value.strip() for q, (_, u) in self.chosen.items() if u.value.strip()}
        said: dict[str, Any] = {"columns": titles, "units": units} if titles or units else {}
        if self.part.value.strip():
            said["part"] = self.part.value.strip()
        self.session.say(self.file.value, said)
