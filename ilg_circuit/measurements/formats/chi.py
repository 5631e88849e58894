"""CH Instruments' text files: Time/sec, Potential/V, Current/A; times or potentials may be in the settings only."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...errors import InputError
from ..cells import NO_READING, is_number, number
from ..kind import RECORD, Kind
from ..table import Rows, Table, parse_rows

NAME = "CH Instruments"
KINDS: tuple[Kind, ...] = (RECORD,)

_KNOWN = {
    "time/s": ("time", "s"),
    "time/sec": ("time", "s"),
    "potential/v": ("voltage", "V"),
    "current/a": ("current", "A"),
}
_SETTING = re.compile(r"([A-Z][A-Za-z0-9 /]{0,30}?) {0,3}(?:\([^()]{1,8}\))? {0,3}= {0,3}(\S{1,30})")
_PREAMBLE = 200


def recognises(lines: Sequence[str]) -> Kind | None:
    """Return RECORD for a file that names the instrument and has a table without a time or without a potential."""
    if not any("CHI" in line and "Model" in line for line in lines[:12]):
        return None
    row = _header(lines)
    return RECORD if row is not None and not {"time", "voltage"} <= _quantities(lines[row]) else None


def read(lines: Sequence[str], name: str, kind: Kind) -> Table:
    """Return the record: a potential step's levels, or the times of a scan, are made from the settings.

    Raises
    ------
    InputError
        The settings for these are missing, or a cell is not a number.
    """
    row = _header(lines)
    if row is None:
        raise InputError(f"{name}: no row of names such as Time/sec, Current/A")
    settings = {m[1].strip().lower(): m[2] for line in lines[:row] if (m := _SETTING.match(line.strip()[:120]))}
    titles = [cell.strip() for cell in lines[row].split(",")]
    rows: Rows = [
        (k, [cell.strip() for cell in line.split(",")])
        for k, line in enumerate(lines[row + 1 :], row + 2)
        if line.strip() and is_number(line.split(",")[0].strip())
    ]
    there = _quantities(lines[row])
    if "time" not in there and "voltage" in there:
        at = [word.lower() for word in titles].index("potential/v")
        rows, titles = _timed(rows, at, _setting(settings, name, "scan rate"), name), ["Time/sec", *titles]
    elif "voltage" not in there and "time" in there:
        levels, width = _levels(settings, name), _setting(settings, name, "pulse width")
        places = [word.lower() for word in titles]
        at = next(k for k, word in enumerate(places) if word.startswith("time"))
        steps = [min(int(max(_value(row, at, name), 0.0) / width), len(levels) - 1) for row in rows]
        rows = [(k, [*cells, repr(levels[step])]) for (k, cells), step in zip(rows, steps, strict=True)]
        titles = [*titles, "Potential/V"]
    return parse_rows([(row + 1, titles), *rows], name, kind.knowing(_KNOWN), ())


def _header(lines: Sequence[str]) -> int | None:
    return next((k for k, line in enumerate(lines[:_PREAMBLE]) if len(_quantities(line)) > 1), None)


def _quantities(line: str) -> set[str]:
    cells = [cell.strip().lower() for cell in line.split(",")] if len(line) < 1000 else []
    return {_KNOWN[cell][0] for cell in cells if cell in _KNOWN}


def _timed(rows: Rows, at: int, rate: float, name: str) -> Rows:
    """Return rows with the time [s] of a scan of the potential, their cell ``at``, before them."""
    potential = [_value(row, at, name) for row in rows]
    time, timed = 0.0, []
    for j, (k, cells) in enumerate(rows):
        time += abs(potential[j] - potential[max(j - 1, 0)]) / rate
        timed.append((k, [repr(time), *cells]))
    return timed


def _value(row: tuple[int, list[str]], at: int, name: str) -> float:
    """Return the number in a cell of a row. Raises InputError where there is none."""
    line, cells = row
    value = number(cells[at]) if at < len(cells) else None
    if value is None or abs(value) >= NO_READING:
        raise InputError(f"{name}: line {line}: no number where a time or a potential stands")
    return value


def _levels(settings: dict[str, str], name: str) -> list[float]:
    """Return the levels [V] of a chronoamperometry's steps, in their order."""
    high, low = _setting(settings, name, "high e"), _setting(settings, name, "low e")
    steps = int(_setting(settings, name, "step", "steps"))
    first, second = (low, high) if settings.get("init p/n", "P").upper() == "N" else (high, low)
    return [first, second] * max(min(steps, 1000) // 2, 0) + [first] * (steps % 2)


def _setting(settings: dict[str, str], name: str, *words: str) -> float:
    text = next((settings[word] for word in words if word in settings), "")
    if not is_number(text) or (words[0] in ("scan rate", "pulse width", "step") and float(text) <= 0):
        raise InputError(
            f"{name}: its columns do not tell time and potential, and its settings have no '{words[0]}': export all "
            "columns"
        )
    return float(text)
