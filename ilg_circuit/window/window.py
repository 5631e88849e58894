"""One window: its tabs, its state and the line of its work; and the server that makes one for every browser's tab."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import panel as pn

from ..errors import IlgError
from .answers import box
from .export import ExportTab
from .look import shown, tabs
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
        self.stop = pn.widgets.Button(label="Stop", color="danger", width=90, visible=False)
        self.stop.on_click(lambda _event: session.stop())
        self.measure, self.strip = Measure(session), StripTab(session)
        self.sweep, self.design = SweepTab(session), DesignTab(session)
        self.export = ExportTab(session, self.strip)
        self.tabs = tabs(
            ("Measure and fit", self.measure.view),
            ("Strip", self.strip.view),
            ("Sweep", self.sweep.view),
            ("Design", self.design.view),
            ("Export", self.export.view),
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


#: Windows that are open.
_OPEN: set[Window] = set()


def make(files: Sequence[str | Path]) -> Any:
    """Return the page of a new window, in the session of the browser that asks for it."""
    session = Session(pn.state.curdoc.add_next_tick_callback)
    window = Window(session, files)
    _OPEN.add(window)
    session.worker.start()
    pn.state.on_session_destroyed(lambda _context: _close(window))
    pn.state.add_periodic_callback(partial(_beat, window), period=_LOOK)
    return window.template


def _close(window: Window) -> None:
    window.close()
    _OPEN.discard(window)


def _beat(window: Window) -> None:
    if window.session.work is not None:
        window.tell()


def serve(files: Sequence[str | Path], port: int, started: Callable[[], object]) -> None:
    """Serve windows until the process is interrupted, and close them; ``started`` is called once they are served."""
    for name in ("bokeh", "tornado"):
        logging.getLogger(name).setLevel(logging.ERROR)
    before = {each: signal.getsignal(each) for each in _signals()}
    server = pn.serve(
        {"/": lambda: make(files)}, title="ilg_circuit", show=False, start=False, verbose=False, **settings(port)
    )
    caught: list[Any] = []

    def stop(number: int, frame: Any) -> None:  # an exception would be lost in the loop
        caught.append((number, frame))
        server.io_loop.add_callback_from_signal(server.io_loop.stop)

    for each in before:
        signal.signal(each, stop)
    try:
        server.start()
        started()
        if not caught:
            server.io_loop.start()
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
        for window in list(_OPEN):
            _close(window)
        close_all()
    for number, frame in caught[:1]:
        handler = before[number]
        if callable(handler):
            handler(number, frame)


def _signals() -> list[int]:
    """Return the signals that end the server and are not ignored; none in another thread than the main one."""
    if threading.current_thread() is not threading.main_thread():
        return []
    known = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    return [each for each in known if signal.getsignal(each) is not signal.SIG_IGN]
