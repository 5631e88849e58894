"""Runs the items one after another; a failed item is reported and does not stop the others."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ..errors import IlgError, InputError, first_line
from ..extras import require_arm
from ..files import require_writable, write_text
from ..provenance import Provenance
from ..report.axes import save
from .items import STATUSES, Item, Outcome
from .paper_runs import PaperRuns

_NUMBERS, _PAGE = "reproduce.json", "index.html"


def run(items: Sequence[Item], progress: Callable[[int, int], None] | None = None) -> list[Outcome]:
    """Return every item's outcome. ``progress(done, total)`` is called after each."""
    runs, outcomes = PaperRuns(), []
    for k, item in enumerate(items):
        start, made, failure = time.monotonic(), None, ""
        try:
            if item.needs_arm:
                require_arm()
            made = item.make(runs)
        except IlgError as error:
            failure = str(error)
        except Exception as error:  # a fault in one item must not stop the others; page and exit code report it
            failure = f"{type(error).__name__}: {first_line(error)}"
        outcomes.append(Outcome(item, made, failure, time.monotonic() - start))
        if progress:
            progress(k + 1, len(items))
    return outcomes


def make_folder(folder: Path) -> None:
    """Make a folder if absent. Raises InputError where that is impossible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder '{folder}': {error.strerror or error}") from None


def output_folder(folder: Path) -> Path:
    """Return the folder for the results, made if absent. Raises InputError where it cannot be made or written."""
    make_folder(folder)
    for name in (_NUMBERS, _PAGE):
        require_writable(folder / name)
    return folder


def write(outcomes: Sequence[Outcome], folder: Path, provenance: Provenance | None = None) -> list[Path]:
    """Write pictures, items' files, reproduce.json (every number) and the page into ``folder``, each whole.

    The picture of an earlier run is removed where an item has none now. Returns the paths, the page last. Raises
    InputError for what cannot be written.
    """
    from .page import page

    written: list[Path] = []
    texts: dict[str, str] = {}
    for outcome in outcomes:
        made, picture = outcome.made, folder / f"{outcome.item.id}.png"
        if made.figure is not None:
            save(made.figure, picture)
            written.append(picture)
        else:
            picture.unlink(missing_ok=True)
        texts |= made.files
    content = {
        "items": [outcome.to_dict() for outcome in outcomes],
        "count": {status: sum(o.status == status for o in outcomes) for status in STATUSES},
        "provenance": (provenance or Provenance()).to_dict(),
    }
    texts[_NUMBERS] = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    texts[_PAGE] = page(outcomes)
    for name, text in texts.items():
        write_text(folder / name, text)
    return [*written, *(folder / name for name in texts)]
