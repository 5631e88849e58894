"""Presents fits of many files: a table, and each parameter over the files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..fit.estimate import Estimate
from ..identification.batch import Batch, FileFit
from ..units import format_quantity
from .axes import BLUE, Axes, Figure, Panels, grid
from .look import beside
from .page import Grid, Page, Prose, Section, picture
from .parameter_table import batch_rows, estimate_text
from .tables import aligned

__all__ = ["facts", "figure", "headline", "page", "panels", "row", "summary"]

#: Widest table in a terminal.
_WIDTH = 118


def headline(batch: Batch) -> str:
    """Return one line: the number of files, and how many were fitted, without success, or failed."""
    fitted = sum(file.content is not None and not file.exit_code for file in batch)
    bad = sum(file.content is not None and file.exit_code > 0 for file in batch)
    failed = sum(file.content is None for file in batch)
    parts = [(bad, "without success"), (failed, "failed")]
    told = "".join(f", {count} {what}" for count, what in parts if count)
    kept = sum(file.resumed for file in batch)
    earlier = f" ({kept} by an earlier run)" if kept else ""
    return f"{len(batch)} file{'s' * (len(batch) != 1)}, each by itself: {fitted} fitted{earlier}{told}"


def facts(batch: Batch) -> list[tuple[str, str]]:
    """Return mean and spread over the files of each parameter."""
    return [("files", f"{len(batch)}"), *((name, _spread(batch, name)) for name in _fitted(batch))]


def _fitted(batch: Batch) -> list[str]:
    """Return the names of the parameters that were fitted (not held) in at least one file."""
    return [name for name in batch.names if any(e and e.interval is not None for e in batch.estimates(name))]


def _spread(batch: Batch, name: str) -> str:
    found = [e for e in batch.estimates(name) if e is not None]
    values, unit = np.array([e.value for e in found]), found[0].unit
    mean = format_quantity(float(values.mean()), unit, 4)
    if len(values) < 2:
        return mean
    return f"{mean}, standard deviation over {len(values)} files {format_quantity(float(values.std(ddof=1)), unit, 2)}"


def summary(batch: Batch) -> str:
    """Return one row per file, with as many parameters as fit into a line."""
    names = batch.names
    while True:
        header = ("file", "model", *names, "misfit")
        lines = aligned([header, *(_cells(file, names) for file in batch)], "<" * len(header), indent="  ")
        whole = [line for file, line in zip(batch, lines[1:], strict=True) if file.content is not None]
        if len(names) <= 1 or max(map(len, [lines[0], *whole])) <= _WIDTH:
            break
        names = names[:-1]
    left = len(batch.names) - len(names)
    more = [f"  ({left} more parameter{'s' * (left > 1)} in the table of the CSV file)"] if left else []
    spread = [f"  {name}: {_spread(batch, name)}" for name in _fitted(batch)] if len(batch) > 1 else []
    return "\n".join([headline(batch), *lines, *more, *spread])


def row(file: FileFit) -> str:
    """Return a file as one line."""
    values = "; ".join(f"{name} = {_value(e)}" for name, e in list(file.parameters.items())[:3])
    return f"{file.path}: {file.outcome}{f'; {values}' if values else ''}"


def _value(e: Estimate | None) -> str:
    return estimate_text(e, interval=False) if e is not None else ""


def _cells(file: FileFit, names: list[str]) -> tuple[str, ...]:
    path = Path(file.path).name if len(file.path) > 40 else file.path
    if file.content is None:
        return path, file.outcome
    misfit = f"{file.misfit or 0.0:.2%}{' NO SUCCESS' * (file.exit_code > 0)}"
    return path, file.model, *(_value(file.parameters.get(name)) for name in names), misfit


def panels(batch: Batch) -> Panels:
    """Return one panel per parameter: values with 95 % intervals over the files."""

    def panel(name: str) -> Callable[..., Any]:
        return lambda axes, **style: _draw(axes, batch, name, style)

    return {name: panel(name) for name in _fitted(batch)}


def _draw(axes: Axes, batch: Batch, name: str, style: dict[str, Any]) -> Axes:
    found = [(k, e) for k, e in enumerate(batch.estimates(name), 1) if e is not None]
    at, values = [k for k, _ in found], np.array([e.value for _, e in found])
    ends = np.array([e.interval or (e.value, e.value) for _, e in found])
    reach = np.clip(np.nan_to_num(ends, posinf=0.0), values[:, None] / 10, values[:, None] * 10)  # open ends are long
    bars = np.abs(np.stack([values - reach[:, 0], reach[:, 1] - values]))
    how: dict[str, Any] = {"fmt": "o", "ms": 4, "color": BLUE, "capsize": 2} | style
    axes.errorbar(at, values, yerr=bars, **how)
    unit = found[0][1].unit
    axes.set_ylabel(f"{name.replace('_', ' ')}{f'{chr(10)}[{unit}]' if unit else ''}", fontsize="small")
    axes.set_xlabel("file")
    axes.set_xlim(0.5, len(batch) + 0.5)
    axes.locator_params(axis="x", integer=True)
    return axes


def figure(batch: Batch) -> Figure:
    """Return all panels in two columns. Raises InputError where nothing was fitted."""
    from ..errors import InputError

    drawn = list(panels(batch).values())
    if not drawn:
        raise InputError("there is nothing to draw: no file was fitted")
    columns = beside(min(2, len(drawn)))
    rows = -(-len(drawn) // columns)
    made, axes = grid(rows, columns, (4.6 * columns, 2.3 * rows))
    for draw, panel in zip(drawn, axes.flat, strict=False):
        draw(panel)
    for panel in axes.flat[len(drawn) :]:
        panel.set_visible(False)
    return made


def page(batch: Batch) -> Page:
    """Return the batch as a page: the table, and the picture."""
    header, *rows = batch_rows(batch)
    sections = [Section("Files", [Grid(header, rows, words=frozenset({0, 1}))])]
    if panels(batch):
        sections.append(Section("Parameters over the files", [picture(figure(batch), "parameters over the files")]))
    numbered = "; ".join(f"{k} {file.path}" for k, file in enumerate(batch, 1))
    sections.append(Section("Numbers of the files", [Prose(numbered)]))
    return Page("Fits of single files", headline(batch), facts(batch)[:8], (), sections)
