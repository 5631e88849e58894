"""Parameters of a fit, or of many, as a table for a paper or a notebook: LaTeX, Markdown or CSV."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from math import isinf
from pathlib import Path

from ..errors import InputError
from ..files import write_csv, write_text
from ..fit.estimate import Estimate
from ..identification.batch import Batch
from ..identification.identification import Identification
from ..units import concise, format_quantity

_HEADER = ("parameter", "value", "95 % interval")
#: An interval is stated beside the standard error if one side exceeds 1.96 standard errors by this factor.
_WIDER = 1.15
#: Characters that LaTeX does not take as text.
_LATEX = str.maketrans({c: f"\\{c}" for c in "&%$#_{}"} | {"^": r"\^{}", "~": r"\~{}", "\\": r"\textbackslash{}"})


def write_table(result: Identification | Batch, path: str | Path) -> None:
    """Write the parameters of a fit, or of many, as what the suffix of ``path`` says: .tex, .md, or .csv.

    CSV has all digits and all quantities. LaTeX is a tabular that needs no package; with booktabs it has that package's
    rules. Raises InputError for another suffix.
    """
    place = Path(path)
    suffix = place.suffix.lower()
    if suffix == ".csv":
        write_csv(place, result.columns())
    elif suffix in (".tex", ".md"):
        rows = batch_rows(result) if isinstance(result, Batch) else [_HEADER, *_rows(result.estimate_tables())]
        write_text(place, (_latex if suffix == ".tex" else _markdown)(rows))
    else:
        raise InputError(f"cannot write '{path}': end its name in .csv, .tex or .md")


def estimate_text(e: Estimate, *, interval: bool = True) -> str:
    """Return a value such as 332.4(5) ohm, with its ``interval`` if that is wider, or marked as held."""
    if e.stderr is None or e.ci95 is None:
        return f"{format_quantity(e.value, e.unit, 5)} ({'held' if e.fixed_because else 'undetermined'})"
    error, (low, high) = e.reported
    text = concise(e.value, error, e.unit)
    usual = 1.96 * error * _WIDER
    wider = e.value - low > usual or high - e.value > usual
    return f"{text} [{_interval(e)}]" if wider and interval else text


def _interval(e: Estimate) -> str:
    """Return the interval as text; a unit that both ends share is written once."""
    low, high = e.reported[1]
    if isinf(high):
        return f"{format_quantity(low, e.unit, 3)} or more" if low else "no limits"
    upper = format_quantity(high, e.unit, 4)
    lower = format_quantity(low, e.unit, 4)
    number, _, unit = lower.partition(" ")
    return f"{number if unit == upper.partition(' ')[2] else lower} to {upper}" if low else f"{upper} or less"


def batch_rows(batch: Batch) -> list[tuple[str, ...]]:
    """Return a header, and one row per file: outcome and parameters."""
    names = batch.names
    found = [[file.parameters.get(name) for name in names] for file in batch]
    cells = [[estimate_text(e, interval=False) if e else "" for e in row] for row in found]
    return [("file", "outcome", *names), *((f.path, f.outcome, *row) for f, row in zip(batch, cells, strict=True))]


def _rows(tables: Mapping[str, Mapping[str, Estimate]]) -> Iterator[tuple[str, str, str]]:
    """Yield name, value and interval of the parameters and of derived quantities with an error."""
    for kind, table in tables.items():
        for name, e in table.items():
            if e.stderr is not None and e.ci95 is not None:
                yield name, concise(e.value, e.reported[0], e.unit), _interval(e)
            elif kind != "derived":
                yield name, format_quantity(e.value, e.unit, 5), "held" if e.fixed_because else "undetermined"


def _markdown(rows: Sequence[Sequence[str]]) -> str:
    head, *rest = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, ["---"] * len(head), *rest))


def _latex(rows: Sequence[Sequence[str]]) -> str:
    rules = [rf"\providecommand{{\{rule}}}{{\hline}}" for rule in ("toprule", "midrule", "bottomrule")]
    head, *rest = [" & ".join(_escaped(cell) for cell in row) + r" \\" for row in rows]
    begin = rf"\begin{{tabular}}{{{'l' * len(rows[0])}}}"
    return "\n".join([*rules, begin, r"\toprule", head, r"\midrule", *rest, r"\bottomrule", r"\end{tabular}"]) + "\n"


def _escaped(text: str) -> str:
    plain = text.translate(_LATEX).replace("ohm", r"$\Omega$")
    return re.sub(r"(?<=[\d)])e([+-]\d+)", lambda power: rf"$\times 10^{{{int(power[1])}}}$", plain)
