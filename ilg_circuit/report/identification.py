"""Identifications as text, as a page and as a strip's file.

Sections of a page stand in the order in which a referee asks: what was measured and how well it is described, what
follows from it and how sure that is, what else was tried, and how to do it again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..fit.selection import Candidate
from ..identification.current import CurrentData
from ..identification.identification import Identification
from ..identification.motion import DisplacementData
from ..identification.observation_fit import SIZE, ObservationFit
from ..strip.file import dumps, save_actuator
from ..units import format_quantity
from .displacement_metrics import metrics_header, metrics_lines, metrics_notes, metrics_rows
from .estimates import (
    HEADER,
    autocorrelation_picture,
    correlation_section,
    derived_line,
    derived_section,
    estimate_facts,
    estimate_line,
    method_lines,
    parameter_section,
    plus_minus,
    strong_correlations,
)
from .identification_figure import figure, panels
from .laws import law_lines, law_sections
from .page import Grid, Listing, Page, Prose, Section, embedded, picture, repetition

__all__ = ["facts", "figure", "headline", "page", "panels", "save_folder", "summary", "write_actuator"]


def summary(result: Identification) -> str:
    """Return the result for a terminal: candidates, parameters, derived quantities, residuals."""
    lines = [headline(result), *_check_lines(result)]
    if len(result.candidates) > 1:
        lines += ["", *_candidate_lines(result)]
    lines += law_lines(result)
    lines += ["", HEADER, *(estimate_line(name, e) for name, e in result.parameters.items())]
    lines += method_lines(result.parameters)
    if result.own:
        averaged = sorted({name for found in result.own.values() for name in found})
        lines += ["", f"own to each record (above: the geometric mean): {', '.join(averaged)}"]
        every = [(source, name, e) for source, found in result.own.items() for name, e in found.items()]
        lines += [estimate_line(f"  {name}, {source}", e) for source, name, e in every]
    lines += ["", *(derived_line(name, e) for name, e in result.derived.items())]
    lines += ["", *(_statistics_line(result, o) for o in result.observations)]
    strong = [f"{pair}: {value:+.3f}" for pair, value in strong_correlations(result.correlations).items()]
    if strong:
        lines.append(f"correlations beyond 0.9: {'; '.join(strong)}")
    if not result.single:
        lines += ["", *comparison_lines(result)]
    if result.residual_windows:
        lines += ["", *_window_lines(result)]
    if result.metrics is not None:
        lines += ["", *metrics_lines(result.metrics)]
    return "\n".join(lines)


def headline(result: Identification) -> str:
    """Return what was measured, and the model."""
    first = result.data[0]
    if not result.single:
        return f"{files(result)} together, model {result.model}, {_engines(result)}"
    if first.quantity == "impedance":
        f = first.abscissa
        low, high = (format_quantity(float(x), "Hz", 4) for x in (f[0], f[-1]))
        what = f"spectrum of {len(f)} points, {low} to {high}"
    elif result.port is None and isinstance(first, DisplacementData):
        drive = first.drive.text
        beam = f"{result.coupling.motion.beam} beam, " if result.coupling else ""
        return f"{first.source}: displacement under {drive}, as stated; coupling d(s), {beam}{_engines(result)}"
    else:
        onset = format_quantity(result.derived["onset"].value, "s", 6)
        level = first.level if isinstance(first, CurrentData) else None
        step = f"step of {format_quantity(level, 'V', 5)} at" if level is not None else "waveform from"
        what = f"{step} {onset}"
    return f"{first.source}: {what}; model {result.model}, {_engines(result)}"


def facts(result: Identification) -> list[tuple[str, str]]:
    """Return the parameters, each with its standard error, after the residuals."""
    return [("largest rms of the residuals", _worst(result)), *estimate_facts(result.parameters)]


def _worst(result: Identification) -> str:
    worst = max(result.observations, key=lambda o: o.rms_joint / o.size)
    return f"{worst.rms_joint / worst.size:.2%} ({worst.source}, {worst.quantity})"


def files(result: Identification) -> str:
    """Return how many records and spectra."""
    kinds = [d.quantity for d in result.data]
    spectra, films = kinds.count("impedance"), kinds.count("displacement")
    counts = [
        (len(kinds) - spectra - films, "record", "records"),
        (spectra, "spectrum", "spectra"),
        (films, "displacement alone", "displacements alone"),
    ]
    return " and ".join(f"{n} {one if n == 1 else many}" for n, one, many in counts if n)


def _engines(result: Identification) -> str:
    engines = dict.fromkeys(d.engine for d in result.data)
    return " and ".join(name if name == "closed form" else f"{name} in the loop" for name in engines)


def write_actuator(result: Identification, path: str | Path) -> None:
    """Write the fitted actuator as TOML, with its origin as a comment."""
    comment = [
        f"fitted by ilg_circuit {__version__} to {', '.join(result.sources)}, model {result.model}",
        *(f"{name} = {format_quantity(e.value, e.unit, 5)}{plus_minus(e)}" for name, e in result.parameters.items()),
        *(f"warning: {line}" for line in result.warnings),
    ]
    save_actuator(result.actuator, path, "\n".join(comment), result.provenance)


def save_folder(result: Identification, path: str | Path) -> None:
    """Write all results into a folder, see `report.folder`."""
    from .folder import save_folder as save

    save(result, path)


def page(result: Identification, drawn: bytes | None = None) -> Page:
    """Return the report as a page; ``drawn`` is its picture as a .png file, if that was drawn already."""
    about = "measurements, fit, prediction, residuals"
    told = [("model", result.model), ("measured", files(result)), ("largest rms of the residuals", _worst(result))]
    sections = [
        Section("Data, fit and residuals", [embedded(drawn, about) if drawn else picture(figure(result), about)]),
        *_check_sections(result),
        Section("Residuals of every file", [_comparison(result), *(Prose(n) for n in comparison_notes(result))]),
        *([Section("Candidates", [_candidates(result), Prose(f"{_basis(result)}.")])] if result.candidates else []),
        *law_sections(result),
        parameter_section(result.parameters),
        *(parameter_section(found, f"Parameters of {source} by itself") for source, found in result.own.items()),
        derived_section(result.derived),
        *_metrics_sections(result),
        *([Section("Residuals by window of time", [_windows(result)])] if result.residual_windows else []),
        Section("Autocorrelation of the residuals", [autocorrelation_picture(_residuals(result))]),
        correlation_section(result.fit.labels, result.correlations),
        Section("Statistics", [Grid(("statistic", "value"), list(_flat(result.statistics)))]),
        Section("The fitted strip", [Listing(dumps(result.actuator))]),
        Section("Its circuit", [Listing(str(strip_netlist(result.actuator, beam="static").to_pyspice()))]),
        repetition(result.provenance.call, _programs(result)),
    ]
    return Page(", ".join(result.sources), headline(result), told, result.warnings, sections)


def _statistics_line(result: Identification, o: ObservationFit) -> str:
    """Return rmse, criteria and number of samples of one observation."""
    s, of = o.statistics, f"{o.rms_joint / o.size:.2%} of {'the ' * (o.quantity != 'impedance')}{SIZE[o.quantity]}"
    name = o.quantity if result.single else f"{o.source}, {o.quantity}"
    size = f"{format_quantity(s['rmse'], o.unit, 3)} ({of})" if o.unit else of
    line = f"{name}: rmse {size}, AIC {s['aic']:.1f}, BIC {s['bic']:.1f}, n {s['n']}"
    if o.quantity == "displacement" and result.coupling is not None:
        window = format_quantity(float(o.abscissa[-1]), "s", 4)
        line += f", {result.coupling.motion.beam} beam, first {window}"
    return line


def _check_lines(result: Identification) -> list[str]:
    lines = []
    for o in result.observations:
        if o.check is not None:
            name, bad = "" if result.single else f", {o.source}", int(o.check.bad.sum())
            left_out = f"{bad} of {len(o.check.bad)} points left out" if bad else "no point left out"
            lines.append(f"Kramers-Kronig{name}: residuals {o.check.rms:.2%} rms of abs(Z), {left_out}")
    return lines


def _check_sections(result: Identification) -> list[Section]:
    blocks = []
    for o in result.observations:
        if o.check is None:
            continue
        pairs = zip(o.check.frequency[o.check.bad], o.check.residuals[o.check.bad], strict=True)
        bad = ", ".join(f"{format_quantity(float(f), 'Hz', 4)} ({abs(r):.1%})" for f, r in pairs)
        left_out = f"Left out, since they break the relations: {bad}." if bad else "No point was left out."
        blocks.append(
            Prose(
                f"{o.source}: a linear measurement model obeys the Kramers-Kronig relations (the spectrum determines "
                f"{o.check.freedom:.0f} of its unknowns); its residuals, the spectrum's own noise, are "
                f"{o.check.rms:.2%} rms of abs(Z). {left_out}"
            )
        )
    return [Section("Kramers-Kronig check", blocks)] if blocks else []


def _candidate_rows(result: Identification) -> list[tuple[str, str, str, str, str]]:
    best = min((c.bic for c in result.candidates if c.bic is not None), default=0.0)

    def row(c: Candidate) -> tuple[str, str, str, str, str]:
        if c.bic is None or c.misfit is None:
            return c.model, "", "", "", c.verdict
        return c.model, f"{c.parameters}", f"{c.misfit:.2%}", f"{c.bic - best:.1f}", c.verdict

    return [row(c) for c in result.candidates]


def _basis(result: Identification) -> str:
    """Return a note on the data that the BIC of all candidates is computed from."""
    fitted = [c for c in result.candidates if c.independent and c.misfit is not None]
    richest = min(fitted, key=lambda c: c.misfit or 0.0)
    return f"BIC on {richest.independent:.3g} independent samples for all, by the residuals of {richest.model}"


def _candidate_lines(result: Identification) -> list[str]:
    lines = [f"{'model':<14}{'parameters':>11}{'rms':>9}{'BIC - best':>12}   verdict"]
    rows = [f"{m:<14}{n:>11}{rms:>9}{bic:>12}   {why}" for m, n, rms, bic, why in _candidate_rows(result)]
    return [*lines, *rows, f"({_basis(result)})"]


def _candidates(result: Identification) -> Grid:
    header = ("model", "parameters", "rms", "BIC above the best", "verdict")
    chosen = frozenset(k for k, c in enumerate(result.candidates) if c.chosen)
    return Grid(header, _candidate_rows(result), words=frozenset({0, 4}), marked=chosen)


def _comparison_rows(result: Identification) -> list[tuple[str, ...]]:
    return [
        (
            o.source,
            o.quantity,
            format_quantity(o.voltage, "V", 4),
            f"{o.rms_individual / o.size:.2%}",
            f"{o.rms_joint / o.size:.2%}",
            "-" if o.rms_predicted is None else f"{o.rms_predicted / o.size:.2%}",
        )
        for o in result.observations
    ]


def comparison_lines(result: Identification) -> list[str]:
    """Return one line per file and quantity: residual rms of the individual fit, the joint fit and the prediction."""
    wide = max(len(o.source) for o in result.observations) + 2
    lines = [f"{'':<{wide}}{'':<14}{'voltage':>10}{'own fit':>10}{'joint':>10}{'from the others':>18}"]
    for source, quantity, voltage, own, joint, predicted in _comparison_rows(result):
        lines.append(f"{source:<{wide}}{quantity:<14}{voltage:>10}{own:>10}{joint:>10}{predicted:>18}")
    return [*lines, *(f"({note})" for note in comparison_notes(result))]


def comparison_notes(result: Identification) -> list[str]:
    """Return notes on the comparison: the reference of the rms, the meaning of individual fits and predictions."""
    lines = ["rms of residuals over: peak current; abs(Z); span of the displacement"]
    if result.own:
        lines.append("what is own to each record is predicted as the geometric mean of the others")
    others = (result.model, "d(s)")
    simpler = [f"{o.source} by {o.individual_model}" for o in result.observations if o.individual_model not in others]
    if simpler:
        lines.append(f"own fits by the model that one file determines by itself: {', '.join(simpler)}")
    return lines + [
        f"not predicted: {o.source}, {o.quantity}: {o.not_predicted_because}"
        for o in result.observations
        if o.not_predicted_because
    ]


def _comparison(result: Identification) -> Grid:
    header = ("record", "quantity", "voltage", "own fit", "joint fit", "from the others")
    return Grid(header, _comparison_rows(result), words=frozenset({0, 1}))


def _window_rows(result: Identification) -> Iterator[tuple[str, list[tuple[str, str, str]]]]:
    """Yield a time window, and for each quantity the rms (absolute, relative) and the number of samples."""
    windows, by_quantity = result.residual_windows, {o.quantity: o for o in result.observations}
    for w in next(iter(windows.values())):
        cells = []
        for name, o in by_quantity.items():
            part = next((x for x in windows[name] if x.start == w.start), None)
            share = f"{part.rms / o.size:.2%}" if part else ""
            cells.append((format_quantity(part.rms, o.unit, 3), share, f"{part.count}") if part else ("", "", ""))
        yield f"{format_quantity(w.start, 's', 3)} to {format_quantity(w.end, 's', 3)}", cells


def _window_lines(result: Identification) -> list[str]:
    names = [(o.quantity, SIZE[o.quantity]) for o in result.observations]
    head = "".join(f"{name + ', rms':>20}{'of ' + of:>11}{'n':>7}" for name, of in names)
    lines = [f"{'residuals since the onset':<28}{head}"]
    for window, cells in _window_rows(result):
        lines.append(f"{window:<28}" + "".join(f"{rms:>20}{share:>11}{n:>7}" for rms, share, n in cells).rstrip())
    return lines


def _windows(result: Identification) -> Grid:
    header = ["since the onset"]
    for o in result.observations:
        header += [f"{o.quantity}: rms", f"of {SIZE[o.quantity]}", "samples"]
    return Grid(header, [[window, *(cell for row in cells for cell in row)] for window, cells in _window_rows(result)])


def _metrics_sections(result: Identification) -> list[Section]:
    if result.metrics is None:
        return []
    grid = Grid(("figure", *metrics_header(result.metrics)), metrics_rows(result.metrics))
    note = Prose(" ".join(f"{line[0].upper()}{line[1:]}." for line in metrics_notes(result.metrics)))
    return [Section("Displacement: peak, settling, back-relaxation", [grid, note])]


def _residuals(result: Identification) -> list[tuple[str, Array]]:
    """Return the residuals of each observation; for an impedance real and imaginary part, relative to abs(Z)."""
    found: list[tuple[str, Array]] = []
    for o in result.observations:
        if o.quantity == "impedance":
            relative = o.residuals / np.abs(o.data)
            found += [(f"{o.source}, real part", relative.real), (f"{o.source}, imaginary part", relative.imag)]
        else:
            found.append((f"{o.source}, {o.quantity}", o.residuals))
    return found


def _flat(statistics: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    for name, value in statistics.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{name}: ")
        else:
            yield above + name, f"{value:.6g}" if isinstance(value, float) else str(value)


def _programs(result: Identification) -> Sequence[str]:
    """Return the version of the circuit solver, if the fit used it."""
    if result.engine != "ngspice":
        return ()
    from ..solve.ngspice import session

    return (f"ngspice {session().version}",)
