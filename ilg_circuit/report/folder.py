"""Writes all results of a fit into one folder: strip, numbers, picture, page, table of parameters."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError, visible
from ..files import marked, replacing_folder, require_folder
from ..findings import by_importance
from ..identification.identification import Identification
from ..identification.observation_fit import SIZE
from .axes import rendered
from .page import SHARPNESS, write_page
from .parameter_table import estimate_text, write_table

#: Files of a folder, written by `Result.save` according to their suffix; the table is last.
FILES = ("fitted.toml", "fit.json", "fit.png", "report.html", "parameters.csv")
#: Most lines of parameters, widest line, and most warnings of the short text.
_LINES, _WIDTH, _WARNINGS = 5, 112, 2
#: Derived quantities that were fitted too.
_CLOCK = ("displacement_delay", "displacement_clock_rate")


def save_folder(fit: Identification, path: str | Path, *, force: bool = False, key: str = "") -> None:
    """Write the folder, whole or not at all: see `FILES`.

    A folder that is there is replaced if a fit made it and nothing was added to it, or by ``force``. ``key`` tells
    what was fitted and how. Raises InputError for a folder that is not to be replaced.
    """
    from .identification import page

    marker = {"made_by": fit.provenance.version, "inputs": list(fit.sources), "key": key}
    strip, numbers, drawn, report, table = FILES
    with replacing_folder(Path(path), marker, force=force) as folder:
        fit.save(folder / strip)
        fit.save(folder / numbers)
        picture = rendered(fit.figure(), provenance=fit.provenance, dpi=SHARPNESS)  # once for both
        (folder / drawn).write_bytes(picture)
        write_page(page(fit, picture), folder / report, fit.provenance)
        write_table(fit, folder / table)


def folder_beside(data: Sequence[Path]) -> tuple[Path, str]:
    """Return the folder for a fit of files, and a note where it is not beside the first of them.

    It has the name of the first file, with the ending .fit: step.fit; where that holds the fit of other files it is
    step.csv.fit, or step+2.fit for step.csv and two more. Where the file's folder cannot be written to it is in the
    working folder.
    """
    from os import W_OK, X_OK, access

    first, note = data[0], ""
    folder = first.parent / f"{first.stem}.fit"
    if _of_others(folder, data):
        folder = first.parent / (f"{first.stem}+{len(data) - 1}.fit" if len(data) > 1 else f"{first.name}.fit")
    if not first.is_file():  # a pipe
        folder = Path(folder.name)
    elif not access(first.parent, W_OK | X_OK):
        folder, note = Path(folder.name), f"'{first.parent}' is write-protected, so it is in the working folder"
    return folder, note


def require_own(folder: Path, data: Sequence[Path], *, force: bool = False) -> None:
    """Raise InputError if the folder holds the fit of other data than ``data``."""
    require_folder(folder, force=force, inputs=data)
    if (held := _of_others(folder, data)) and not force:
        raise InputError(f"'{folder}' holds the fit of {held}; name another by --folder, or give --force")


def _of_others(folder: Path, data: Sequence[Path]) -> str:
    """Return the names of the files whose fit the folder holds; empty if these are ``data``, or if it holds no fit."""
    held = [re.sub(r" \(\d+\)$", "", str(name)) for name in marked(folder).get("inputs", ())]  # step.csv (2)
    return "" if held == [visible(file.name) for file in data] else ", ".join(held)


def short_text(fit: Identification, folder: str | Path, note: str = "") -> tuple[str, list[str]]:
    """Return a fit in at most eight lines, and its two most important warnings; the rest is in the ``folder``."""
    from .identification import headline

    told, left = told_first(fit)
    worst = {o.quantity: o for o in sorted(fit.observations, key=lambda o: o.rms_joint / o.size)}
    misfit = ", ".join(f"{name} {o.rms_joint / o.size:.2%} of its {SIZE[name]}" for name, o in worst.items())
    head = headline(fit)
    lines = [head if len(head) <= _WIDTH + 8 else f"{head[: _WIDTH + 5]}..."]
    clock = {name: e for name, e in fit.derived.items() if name in _CLOCK and e.stderr is not None}
    lines += _packed([f"{name} = {estimate_text(e)}" for name, e in {**fit.parameters, **clock}.items()])
    lines.append(f"misfit (rms): {misfit}" if fit.success else f"misfit (rms): {misfit}: NO SUCCESS")
    more = f"; {left} more warning{'s' * (left > 1)} there" if left else ""
    lines.append(f"{folder}/: {', '.join(FILES)}{f' ({note})' if note else ''}{more}")
    return "\n".join(lines), told


def told_first(fit: Identification) -> tuple[list[str], int]:
    """Return the most important warnings, and a note on the number of others."""
    warnings = list(dict.fromkeys(map(str, by_importance(fit.findings))))
    return warnings[:_WARNINGS], len(warnings[_WARNINGS:])


def _packed(items: Sequence[str]) -> list[str]:
    """Return items on few lines."""
    lines: list[str] = []
    for number, item in enumerate(items):
        if lines and len(lines[-1]) + 3 + len(item) <= _WIDTH:
            lines[-1] += f";  {item}"
        elif len(lines) == _LINES:
            lines[-1] += f";  and {len(items) - number} more"
            break
        else:
            lines.append(f"  {item}")
    return lines
