"""Parameters of a fit as a table for a paper or a notebook: LaTeX, Markdown or CSV."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from ..errors import InputError
from ..files import write_csv, write_text
from ..fit.estimate import Estimate, Estimated
from ..result import Result
from ..units import concise, format_quantity
from .estimates import interval_text

_HEADER = ("parameter", "value", "95 % interval")
#: An interval is told beside a standard error where it is so much wider than 1.96 of it to either side.
_WIDER = 1.15
#: What LaTeX takes for more than text.
_LATEX = str.maketrans({c: f"\\{c}" for c in "&%$#_{}"} | {"^": r"\^{}", "~": r"\~{}", "\\": r"\textbackslash{}"})


def write_table(result: Result, path: str | Path) -> None:
    """Write the parameters of a fit as what the suffix of ``path`` says: .tex, .md, or .csv with all digits.

    LaTeX is a tabular without further packages; with booktabs it has that package's rules.
    """
    place = Path(path)
    suffix = place.suffix.lower()
    if suffix in ("", ".csv"):
        write_csv(place, result.columns())
        return
    if not isinstance(result, Estimated) or suffix not in (".tex", ".md"):
        raise InputError(f"cannot write '{path}': end its name in .csv, .tex or .md")
    write_text(place, (_latex if suffix == ".tex" else _markdown)(list(_rows(result.estimate_tables()))))


def estimate_text(e: Estimate) -> str:
    """Return a value as 332.4(5) ohm, with its interval where that is wider, or that it was held."""
    if e.stderr is None or e.ci95 is None:
        return f"{format_quantity(e.value, e.unit, 5)} ({'held' if e.fixed_because else 'undetermined'})"
    error, (low, high) = e.reported
    text = concise(e.value, error, e.unit)
    usual = 1.96 * error * _WIDER
    return text if e.value - low <= usual and high - e.value <= usual else f"{text} [{interval_text(e)}]"


def _rows(tables: Mapping[str, Mapping[str, Estimate]]) -> Iterator[tuple[str, str, str]]:
    for table in tables.values():
        for name, e in table.items():
            if e.stderr is None or e.ci95 is None:
                why = e.fixed_because or "undetermined"
                yield name, format_quantity(e.value, e.unit, 5), why
            else:
                yield name, concise(e.value, e.reported[0], e.unit), interval_text(e)


def _markdown(rows: list[tuple[str, str, str]]) -> str:
    lines = [_HEADER, ("---", "---", "---"), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |\n" for row in lines)


def _latex(rows: list[tuple[str, str, str]]) -> str:
    rules = [rf"\providecommand{{\{rule}}}{{\hline}}" for rule in ("toprule", "midrule", "bottomrule")]
    cells = [" & ".join(_escaped(cell) for cell in row) + r" \\" for row in (_HEADER, *rows)]
    body = [r"\toprule", cells[0], r"\midrule", *cells[1:], r"\bottomrule"]
    return "\n".join([*rules, r"\begin{tabular}{lll}", *body, r"\end{tabular}"]) + "\n"


def _escaped(text: str) -> str:
    return text.translate(_LATEX).replace("ohm", r"$\Omega$")
