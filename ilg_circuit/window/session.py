"""The state of one window: its strip, its files, its fit, and its solver process. Tabs show it and change it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..errors import InputError, visible
from ..front.runs import simulate
from ..strip.actuator import PAPER, Actuator
from ..strip.file import load_strip
from ..strip.specimen import Specimen
from .answers import Answer
from .tasks import Source
from .worker import Task, Told, Worker

#: Module of the tasks.
_TASKS = f"{__package__}.tasks"


@dataclass(frozen=True)
class Work:
    """The task that is being worked on: what is being done, since when, how far it is (total None: not known)."""

    doing: str
    since: float
    done: float = 0.0
    total: float | None = None

    def line(self) -> str:
        """Return one line on the work for people."""
        spent = f"{time.monotonic() - self.since:.0f} s"
        if self.total:
            return f"{self.doing}: {self.done / self.total:.0%}, {spent}"
        return f"{self.doing}: {f'{self.done:.0f} evaluations, ' if self.done else ''}{spent}"


class Session:
    """The state of one window.

    ``given`` is the strip that was opened, None for none; ``base`` the strip that the tabs begin with: opened, fitted
    or designed; ``strip`` the same with its sliders moved. ``soon`` calls a function in the window's own thread.

    Listeners of `on` are called with nothing when one of these changes: ``base``, ``strip``, ``files``, ``fit``,
    ``run``, ``work``.
    """

    def __init__(self, soon: Callable[[Callable[[], object]], object] = lambda call: call()) -> None:
        self.soon = soon
        self.given: Actuator | Specimen | None = None
        self.base: Actuator = PAPER
        self.strip: Actuator = PAPER
        self.origin = "the paper's strip"
        self.sources: list[Source] = []
        self.fit: Answer | None = None
        self.run: Any = None
        self.work: Work | None = None
        self.worker = Worker()
        self._folder = TemporaryDirectory(prefix="ilg_circuit_")
        self._count = 0
        self._listeners: dict[str, list[Callable[[], object]]] = {}

    @property
    def folder(self) -> Path:
        """A folder of the window's own, gone with it."""
        return Path(self._folder.name)

    def on(self, what: str, listener: Callable[[], object]) -> None:
        """Have a listener called when ``what`` changes."""
        self._listeners.setdefault(what, []).append(listener)

    def tell(self, what: str) -> None:
        """Call the listeners of ``what``."""
        for listener in self._listeners.get(what, []):
            listener()

    def take_strip(self, strip: Actuator, origin: str) -> None:
        """Have the tabs begin with another strip."""
        self.base = self.strip = strip
        self.origin = origin
        self.tell("base")

    def move(self, strip: Actuator) -> None:
        """Take the strip with its sliders moved."""
        self.strip = strip
        self.tell("strip")

    def open(self, path: str | Path, name: str | None = None) -> None:
        """Take a file that is on this machine: a strip (.toml), or a measurement. Raises InputError for neither."""
        shown = visible(name or str(path))
        if str(path) == "paper" or Path(path).suffix.lower() == ".toml":
            found = load_strip(path)
            self.given = found
            if isinstance(found, Actuator):
                self.take_strip(found, shown)
            self.tell("files")
            return
        if not Path(path).is_file():
            raise InputError(f"there is no file '{shown}'; give a measurement or the TOML file of a strip")
        if any(each.name == shown for each in self.sources):
            self.sources = [each for each in self.sources if each.name != shown]
        self.sources.append(Source(Path(path), shown))
        self.tell("files")

    def take(self, name: str, content: bytes) -> None:
        """Take a file that was dropped on the window: a copy in the window's folder. Raises InputError as `open`."""
        self._count += 1
        place = self.folder / str(self._count)
        place.mkdir()
        plain = Path(name.replace("\\", "/")).name or "file"
        path = place / plain
        try:
            path.write_bytes(content)
        except (OSError, ValueError):
            raise InputError(f"'{visible(plain)}' cannot be kept; give the file another name") from None
        self.open(path, plain)

    def take_example(self) -> None:
        """Take a simulated record of the paper's strip under 4 V, with noise and a rest: that of the command demo."""
        from ..reproduce.demo import measured

        run = simulate(PAPER, "step:4V", "300 s", beam="static", engine="exact")
        self.take("example.csv", measured(run).encode())

    def say(self, name: str, said: dict[str, Any]) -> None:
        """Take what a user says of a file's columns and units."""
        self.sources = [Source(s.path, s.name, said) if s.name == name else s for s in self.sources]
        self.tell("files")

    def leave_out(self, names: Iterable[str]) -> None:
        """Forget files."""
        gone = set(names)
        self.sources = [each for each in self.sources if each.name not in gone]
        self.tell("files")

    def start(
        self,
        doing: str,
        function: str,
        arguments: dict[str, Any],
        done: Callable[[Any], object],
        failed: Callable[[str], object],
    ) -> None:
        """Have a function of `tasks` worked on by the solver process; ``done`` or ``failed`` is called at its end."""
        if self.work is not None:
            failed(f"{self.work.doing} is not finished; wait for it, or stop it")
            return
        self.work = Work(doing, time.monotonic())
        self.tell("work")
        self.worker.submit(
            Task(_TASKS, function, arguments), lambda told: self.soon(partial(self._heard, told, done, failed))
        )

    def stop(self) -> None:
        """Stop the work."""
        if self.work is not None:
            self.worker.stop()

    def _heard(self, told: Told, done: Callable[[Any], object], failed: Callable[[str], object]) -> None:
        if self.work is None:
            return
        if told.kind == "progress":
            self.work = Work(self.work.doing, self.work.since, *told.value)
            self.tell("work")
            return
        doing, self.work = self.work.doing, None
        self.tell("work")
        if told.kind == "done":
            done(told.value)
        elif told.kind == "stopped":
            failed(f"{doing} was stopped")
        else:
            failed(str(told.value))

    def close(self) -> None:
        """End the solver process and remove the window's folder."""
        self.worker.close()
        self._folder.cleanup()


def texts(value: str) -> Sequence[str]:
    """Return the entries of a field that holds several, separated by lines or semicolons."""
    return [part.strip() for line in value.splitlines() for part in line.split(";") if part.strip()]
