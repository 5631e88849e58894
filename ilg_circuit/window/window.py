"""One window: its tabs, its state and the line of its work; and the server that makes one for every browser's tab."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import panel as pn

from ..errors import IlgError
from .answers import box
from .export import ExportTab
from .look import shown
from .measure import Measure
from .serve import settings
from .session import Session
from .strip import StripTab
from .study import DesignTab, SweepTab
from .worker import close_all

_HERE = Path(__file__).parent
#: Time between two looks at how long the work has taken [ms].
_LOOK = 500


class Window:
    """The tabs of one session; ``template`` is the page."""

    def __init__(self, session: Session, files: Sequence[str | Path] = ()) -> None:
        self.session = session
        self.work = shown()
        self.stop = pn.widgets.Button(name="Stop", button_type="danger", width=90, visible=False)
        self.stop.on_click(lambda _event: session.stop())
        self.measure, self.strip = Measure(session), StripTab(session)
        self.sweep, self.design = SweepTab(session), DesignTab(session)
        self.export = ExportTab(session, self.strip)
        self.tabs = pn.Tabs(
            ("Measure and fit", self.measure.view),
            ("Strip", self.strip.view),
            ("Sweep", self.sweep.view),
            ("Design", self.design.view),
            ("Export", self.export.view),
            sizing_mode="stretch_width",
        )
        self.status = pn.Row(self.work, self.stop, sizing_mode="stretch_width")
        session.on("work", self.tell)
        wrong = []
        for path in files:
            try:
                session.open(path)
            except IlgError as error:
                wrong.append(str(error))
        self.measure.refused.object = box("error", *wrong)
        self.template = pn.Template(
            (_HERE / "window.html.j2").read_text(encoding="utf-8"),
        )
        self.template.add_variable("title", "ilg_circuit")
        for name, kind in (("style", "window.css"), ("script", "drop.js")):
            self.template.add_variable(name, (_HERE / kind).read_text(encoding="utf-8"))
        self.template.add_panel("status", self.status)
        self.template.add_panel("tabs", self.tabs)

    def tell(self) -> None:
        """Say what is being worked on, and how far it is."""
        work = self.session.work
        self.work.object = box("note", work.line()) if work is not None else ""
        self.stop.visible = work is not None

    def close(self) -> None:
        """End what the window has."""
        self.strip.close()
        self.session.close()


def make(files: Sequence[str | Path]) -> Any:
    """Return the page of a new window, in the session of the browser that asks for it."""
    document = pn.state.curdoc
    session = Session(document.add_next_tick_callback)
    window = Window(session, files)
    session.worker.start()
    pn.state.on_session_destroyed(lambda _context: window.close())
    pn.state.add_periodic_callback(partial(_beat, window), period=_LOOK)
    return window.template


def _beat(window: Window) -> None:
    if window.session.work is not None:
        window.tell()


def serve(files: Sequence[str | Path], port: int, started: Callable[[], object]) -> None:
    """Serve windows until the process is interrupted; ``started`` is called once they are served."""
    for name in ("bokeh", "tornado"):
        logging.getLogger(name).setLevel(logging.ERROR)
    server = pn.serve(
        {"/": lambda: make(files)}, title="ilg_circuit", show=False, start=False, verbose=False, **settings(port)
    )
    try:
        server.start()
        started()
        server.io_loop.start()
    finally:
        close_all()
        server.stop(wait=False)
