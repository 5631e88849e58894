"""Make items one after another: what fails is an outcome too, and stops nothing."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..errors import IlgError, InputError
from ..extras import require_arm
from ..files import require_writable, write_text
from ..report.axes import save
from .items import LIGHTS, Item, Made, Outcome
from .runs import Runs

_NUMBERS, _PAGE = "reproduce.json", "index.html"

Progress = Callable[[int, int], None]


def make(items: Sequence[Item], progress: Progress | None = None) -> list[Outcome]:
    """Every item's outcome. ``progress(done, total)`` is called after each."""
    runs, outcomes = Runs(), []
    for k, item in enumerate(items):
        outcomes.append(_attempt(item, runs))
        if progress:
            progress(k + 1, len(items))
    return outcomes


def _attempt(item: Item, runs: Runs) -> Outcome:
    start = time.monotonic()
    try:
        if item.needs_arm:
            require_arm()
        made = item.make(runs)
    except IlgError as error:
        return Outcome(item, None, str(error), time.monotonic() - start)
    except Exception as error:
        # a fault of ours in one item must not cost the others; the page and the exit code say so
        return Outcome(item, None, f"{type(error).__name__}: {error}", time.monotonic() - start)
    return Outcome(item, made, "", time.monotonic() - start)


def prepared(folder: Path) -> Path:
    """The folder for the results, made if absent. Raises InputError where it cannot be made or written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder '{folder}': {error.strerror or error}") from None
    for name in (_NUMBERS, _PAGE):
        require_writable(folder / name)
    return folder


def write(outcomes: Sequence[Outcome], folder: Path) -> list[Path]:
    """Write pictures, items' files, reproduce.json and the page into ``folder``, each whole; the page last.

    Of an item that has no picture now, one that an earlier run left is removed. Returns the paths, the page last.
    """
    from .page import page

    written: list[Path] = []

    def target(name: str) -> Path:
        written.append(folder / name)
        return folder / name

    for outcome in outcomes:
        made, picture = outcome.made or Made(), f"{outcome.item.id}.png"
        if made.figure is not None:
            save(made.figure, target(picture))
        else:
            (folder / picture).unlink(missing_ok=True)
        for name, text in made.files.items():
            if folder / name not in written:
                write_text(target(name), text)
    write_text(target(_NUMBERS), json.dumps(to_json(outcomes), indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    write_text(target(_PAGE), page(outcomes))
    return written


def to_json(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """All numbers. Numbers stand in the unit that is beside them."""
    return {
        "items": [outcome.to_json() for outcome in outcomes],
        "count": {light: sum(o.light == light for o in outcomes) for light in LIGHTS},
    }
