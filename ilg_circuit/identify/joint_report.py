"""A joint fit as text and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..report.axes import BLUE, GREY, ORANGE, engineering, save
from ..units import format_quantity
from .joint import JointFit
from .joint_records import RecordFit
from .report import _row, _text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: Records are drawn in two columns where there are more.
_ONE_COLUMN = 3
#: Axes are logarithmic over more than that, of time and of anything else.
_LOG_SPAN, _DECADE = 30.0, 10.0


def joint_table(result: JointFit) -> str:
    """Candidates, parameters (shared, then own), what follows from them, and what is left of every record."""
    lines = [f"{files(result)} together, model {result.model}, {result.engine} in the loop"]
    if result.candidates:
        lines += ["", *_candidates(result)]
    lines += ["", f"{'parameter':<28}{'value':>16}{'standard error':>18}   95 % interval"]
    lines += [_row(name, p) for name, p in result.parameters.items()]
    if any(p.bootstrap is not None for p in result.parameters.values()):
        lines.append("(where residuals are alike next to one another, both are a block bootstrap's)")
    if result.own:
        averaged = sorted({name for found in result.own.values() for name in found})
        lines += ["", f"own to each record (above: the geometric mean): {', '.join(averaged)}"]
        lines += [_row(f"  {name}, {source}", p) for source, found in result.own.items() for name, p in found.items()]
    lines += ["", *(_derived(name, p) for name, p in result.derived.items())]
    return "\n".join([*lines, "", *comparison(result)])


def files(result: JointFit) -> str:
    """How many records and spectra."""
    spectra = sum(r.quantity == "impedance" for r in result.records)
    records = sum(r.quantity == "current" for r in result.records)
    counts = [(records, "record", "records"), (spectra, "spectrum", "spectra")]
    return " and ".join(f"{n} {one if n == 1 else many}" for n, one, many in counts if n)


def comparison(result: JointFit) -> list[str]:
    """One line a record and quantity: rms of what its own fit, the joint one, and that of all others leave."""
    wide = max(len(r.source) for r in result.records) + 2
    lines = [f"{'':<{wide}}{'':<14}{'voltage':>10}{'own fit':>10}{'joint':>10}{'from the others':>18}"]
    for r in result.records:
        predicted = "-" if r.predicted is None else f"{r.predicted / r.size:.2%}"
        shares = f"{r.own / r.size:>10.2%}{r.joint / r.size:>10.2%}{predicted:>18}"
        lines.append(f"{r.source:<{wide}}{r.quantity:<14}{format_quantity(r.voltage, 'V', 4):>10}{shares}")
    return [*lines, *(f"({note})" for note in comparison_notes(result))]


def comparison_notes(result: JointFit) -> list[str]:
    """What is to be said of the comparison: what rms is relative to, what own fits and predictions are."""
    lines = ["rms of residuals over: peak current; abs(Z); span of the displacement"]
    if result.own:
        lines.append("what is own to each record is predicted as the geometric mean of the others")
    simpler = [f"{r.source} by {r.own_model}" for r in result.records if r.own_model not in (result.model, "d(s)")]
    if simpler:
        lines.append(f"own fits of what one data set holds by itself: {', '.join(simpler)}")
    lines += [f"not predicted: {r.source}, {r.quantity}: {r.unforeseen}" for r in result.records if r.unforeseen]
    return lines


def plot_joint(result: JointFit, path: str | Path) -> None:
    """Write `joint_figure` as a picture."""
    save(joint_figure(result), path)


def joint_figure(result: JointFit) -> Figure:
    """Every record with the joint fit and the prediction from the others, residuals beneath, the comparison last."""
    from matplotlib.figure import Figure

    records = result.records
    columns = 1 if len(records) <= _ONE_COLUMN else 2
    rows = -(-len(records) // columns)
    below = 0.6 + 0.22 * len(records)
    figure = Figure(figsize=(7.5 if columns == 1 else 11.0, 2.6 * rows + below + 0.6), dpi=130, layout="constrained")
    layout: Any = figure.get_layout_engine()
    layout.set(h_pad=0.02, w_pad=0.04, hspace=0.0)
    grid: Any = figure.add_gridspec(rows + 1, columns, height_ratios=[2.6] * rows + [below])
    for k, record in enumerate(records):
        pair = grid[k // columns, k % columns].subgridspec(2, 1, height_ratios=[2.0, 0.9], hspace=0.05)
        upper = figure.add_subplot(pair[0])
        lower = figure.add_subplot(pair[1], sharex=upper)
        _waves(upper, record)
        _residuals(lower, record)
        upper.tick_params(labelbottom=False)
        for panel in (upper, lower):
            panel.grid(alpha=0.25, linewidth=0.6)
            panel.spines[["top", "right"]].set_visible(False)
        if not k:
            upper.legend(frameon=False, fontsize=7)
    _bars(figure.add_subplot(grid[rows, :]), records)
    figure.suptitle(f"{files(result)} together: model {result.model}", fontsize=10)
    return figure


def _waves(panel: Any, r: RecordFit) -> None:
    spectrum = r.quantity == "impedance"
    curves: list[tuple[Any, dict[str, Any], str]] = [
        (r.data, {"linestyle": "", "marker": ".", "color": GREY, "markersize": 3}, "measured"),
        (r.fitted, {"color": BLUE, "linewidth": 1.5}, "joint fit"),
    ]
    if r.foreseen is not None:
        curves.append((r.foreseen, {"color": ORANGE, "linewidth": 1.1, "linestyle": "--"}, "from the others"))
    factor, label = engineering(np.abs(r.data), "\N{OHM SIGN}" if spectrum else r.unit)
    x, shown = _abscissa(panel, r)
    for values, style, name in curves:
        sizes = np.abs(values) if spectrum else values
        panel.plot(x, factor * sizes[shown], **style, label=name)
    if spectrum and np.ptp(np.log(np.abs(r.data))) > np.log(_DECADE):
        panel.set_yscale("log")
    panel.set_ylabel(f"{'abs(Z)' if spectrum else r.quantity}\n[{label}]", fontsize=8)
    voltage = format_quantity(r.voltage, "V", 3)
    where = f"about {voltage}" if spectrum else f"{voltage}"
    panel.set_title(f"{r.source}: {r.quantity}, {where}", fontsize=8, loc="left")
    panel.tick_params(labelsize=7)


def _residuals(panel: Any, r: RecordFit) -> None:
    """Of the joint fit and the prediction, in percent of what the record is measured by."""
    spectrum = r.quantity == "impedance"
    x, shown = _abscissa(panel, r)
    size = np.abs(r.data) if spectrum else r.size
    for fitted, colour in ((r.foreseen, ORANGE), (r.fitted, BLUE)):
        if fitted is None:
            continue
        left = (100 * (r.data - fitted) / size)[shown]
        if spectrum:
            panel.plot(x, left.real, ".-", color=colour, markersize=3, linewidth=0.6)
            panel.plot(x, left.imag, "x-", color=colour, markersize=3, linewidth=0.6)
        else:
            panel.plot(x, left, ".", color=colour, markersize=2)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.set_ylabel("residual\n[%]", fontsize=8)
    panel.set_xlabel("frequency [Hz]" if spectrum else "time since the onset [s]", fontsize=8)
    panel.tick_params(labelsize=7)


def _abscissa(panel: Any, r: RecordFit) -> tuple[Array, NDArray[np.bool_]]:
    """What is shown, by logarithm for a spectrum, and for a record whose samples are that close together."""
    positive = r.abscissa[r.abscissa > 0]
    logarithmic = r.quantity == "impedance" or positive[-1] > _LOG_SPAN * positive[0]
    if logarithmic:
        panel.set_xscale("log")
    shown = r.abscissa > 0 if logarithmic else np.ones(len(r.abscissa), dtype=bool)
    return r.abscissa[shown], shown


def _bars(panel: Any, records: tuple[RecordFit, ...]) -> None:
    """The comparison: three marks a record, by logarithm."""
    places = np.arange(len(records))[::-1]
    marks = (
        ("own fit", "own", "o", GREY),
        ("joint fit", "joint", "s", BLUE),
        ("from the others", "predicted", "D", ORANGE),
    )
    for name, field, marker, colour in marks:
        pairs = [
            (100 * getattr(r, field) / r.size, y)
            for r, y in zip(records, places.tolist(), strict=True)
            if getattr(r, field) is not None
        ]
        if pairs:
            x, y = zip(*pairs, strict=True)
            panel.plot(x, y, marker, color=colour, markersize=5, alpha=0.8, label=name)
    shares = [x for r in records for x in (r.own / r.size, r.joint / r.size, (r.predicted or r.joint) / r.size)]
    if min(shares) > 0 and max(shares) > _DECADE * min(shares):
        panel.set_xscale("log")
    else:
        panel.set_xlim(0.0, 110 * max(shares) or 1.0)
    panel.set_yticks(places, [f"{r.source}, {r.quantity}" for r in records], fontsize=7)
    panel.set_ylim(-0.6, len(records) - 0.4)
    panel.set_xlabel("rms of the residuals [% of peak current, abs(Z), span of the displacement]", fontsize=8)
    panel.tick_params(labelsize=7)
    panel.grid(alpha=0.25, linewidth=0.6, which="both")
    panel.spines[["top", "right"]].set_visible(False)
    panel.legend(frameon=False, fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _candidates(result: JointFit) -> list[str]:
    best = min((c.bic for c in result.candidates if c.bic is not None), default=0.0)
    lines = [f"{'model':<14}{'parameters':>11}{'rms':>9}{'BIC - best':>12}   verdict"]
    for c in result.candidates:
        if c.bic is None or c.misfit is None:
            lines.append(f"{c.model:<14}{'':>32}   {c.verdict}")
        else:
            lines.append(f"{c.model:<14}{c.count:>11}{c.misfit:>9.2%}{c.bic - best:>12.1f}   {c.verdict}")
    return lines


def _derived(name: str, p: Any) -> str:
    error = f"{_text(p.stderr, p.unit, 2):>18}" if p.stderr is not None else ""
    return f"{name:<28}{_text(p.value, p.unit):>16}{error}"
