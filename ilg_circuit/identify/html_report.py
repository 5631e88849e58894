"""Identifications as HTML reports: a step or waveform, a spectrum, several records together.

Sections stand in the order in which a referee asks: what was measured and how well it is described, what follows from
it and how sure that is, what else was tried, and how to do it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..report.page import Grid, Page, Prose, Section, picture, render, repetition, write_page
from ..units import format_quantity
from .html_parts import (
    autocorrelation_picture,
    circuit_sections,
    correlation_section,
    derived_section,
    parameter_section,
)
from .identification import Identification
from .joint import JointFit
from .joint_report import comparison_notes, files, joint_figure
from .report import headline, identification_figure, residual_sizes
from .spectrum_identification import SpectrumIdentification
from .spectrum_report import spectrum_figure, spectrum_headline

Array = NDArray[np.float64]
Result = Identification | SpectrumIdentification | JointFit


def write_report(result: Result, path: str | Path, command: str = "") -> None:
    """Write the report, whole or not at all. ``command`` is the line that makes it again."""
    write_page(page_of(result, command), path)


def html(result: Result, command: str = "") -> str:
    """The report's text."""
    return render(page_of(result, command))


@singledispatch
def page_of(result: Result, command: str) -> Page:
    """The report on a result of any kind."""
    raise TypeError(f"no report is known for {type(result).__name__}")


@page_of.register
def _(result: Identification, command: str) -> Page:
    source, statistics, moved = result.measurement.source, result.statistics, result.displacement
    facts = [
        ("model", result.model),
        ("samples", f"{statistics['n']}"),
        ("current, rms of the residuals", f"{statistics['rmse_over_peak']:.2%} of the peak"),
    ]
    parts = [("current", result.current.fit.residuals)]
    names = list(result.current.fit.names)
    if moved is not None:
        share = moved.fit.rmse / residual_sizes(result)["displacement"][0]
        facts.append(("displacement, rms of the residuals", f"{share:.2%} of its span"))
        parts.append(("displacement", moved.fit.residuals))
        names += moved.fit.names
    sections = [
        Section(
            "Data, fit and residuals",
            [picture(identification_figure(result), "measured current and displacement, fit, residuals, drive")],
        ),
        _candidates(result),
        parameter_section(result.parameters),
        derived_section(result.derived),
        *_figures(result),
        Section("Residuals by window of time", [_windows(result)]),
        Section("Autocorrelation of the residuals", [autocorrelation_picture(parts)]),
        correlation_section(names, result.correlations),
        *circuit_sections(result.actuator, result.statistics),
        repetition(command or f"ilg-circuit identify {source}", _engine(result.engine)),
    ]
    return Page(source, headline(result), facts, result.warnings, sections)


def _figures(result: Identification) -> list[Section]:
    figures = result.figures
    if figures is None:
        return []
    note = Prose(f"{figures.over().capitalize()}. {figures.how().capitalize()}.")
    return [Section("Displacement: peak, settling, back-relaxation", [
        Grid(("figure", "measured", "model"), figures.rows()), note])]  # fmt: skip


def _windows(result: Identification) -> Grid:
    sizes = residual_sizes(result)
    header = ["since the onset"]
    for name, (_, of, _) in sizes.items():
        header += [f"{name}: rms", f"of {of}", "samples"]
    windows = result.residual_windows
    rows = []
    for w in windows["current"]:
        row = [f"{format_quantity(w.start, 's', 3)} to {format_quantity(w.end, 's', 3)}"]
        for name, (size, _, unit) in sizes.items():
            part = next((x for x in windows[name] if x.start == w.start), None)
            row += [format_quantity(part.rms, unit, 3), f"{part.rms / size:.2%}", f"{part.count}"] if part else [""] * 3
        rows.append(row)
    return Grid(header, rows)


def _candidates(result: Identification) -> Section:
    peak = residual_sizes(result)["current"][0]
    best = min((c.bic for c in result.candidates if c.bic is not None), default=0.0)
    rows = [
        (
            c.model,
            f"{len(c.fit.fit.values)}" if c.fit else "",
            f"{c.fit.fit.rmse / peak:.2%}" if c.fit else "",
            f"{c.bic - best:.1f}" if c.bic is not None else "",
            c.verdict,
        )
        for c in result.candidates
    ]
    header = ("model", "parameters", "rms / peak", "BIC above the best", "verdict")
    chosen = frozenset(k for k, c in enumerate(result.candidates) if c.chosen)
    return Section("Candidates", [Grid(header, rows, words=frozenset({0, 4}), marked=chosen)])


@page_of.register
def _(result: SpectrumIdentification, command: str) -> Page:
    source, fit, check = result.spectrum.source, result.fit, result.check
    facts = [
        ("model", result.model),
        ("frequencies", f"{len(result.spectrum.frequency)}"),
        ("residuals, rms of abs(Z)", f"{fit.relative_rms:.2%}"),
        ("Kramers-Kronig residuals, rms", f"{check.rms:.2%}"),
    ]
    real, imaginary = np.split(fit.fit.residuals, 2)
    bad = ", ".join(format_quantity(float(f), "Hz", 4) for f in check.frequency[check.bad])
    checked = (
        f"The Kramers-Kronig check is a linear measurement model of {check.terms} time constants; what it leaves is "
        f"the spectrum's own noise, {check.rms:.2%} rms of abs(Z). "
        + (f"Left out, since they break the relations: {bad}." if bad else "No point breaks the relations.")
    )
    sections = [
        Section(
            "Data, fit, residuals, Kramers-Kronig check",
            [
                picture(spectrum_figure(result), "Bode and Nyquist plots, residuals of the fit and of the check"),
                Prose(checked),
            ],
        ),
        Section("Candidates", [_spectrum_candidates(result)]),
        parameter_section(result.parameters),
        derived_section(result.derived),
        Section(
            "Autocorrelation of the residuals along the frequencies",
            [autocorrelation_picture([("real part", real), ("imaginary part", imaginary)])],
        ),
        correlation_section(fit.fit.names, result.correlations),
        *circuit_sections(result.actuator, result.statistics),
        repetition(command or f"ilg-circuit identify {source}"),
    ]
    return Page(source, spectrum_headline(result), facts, result.warnings, sections)


def _spectrum_candidates(result: SpectrumIdentification) -> Grid:
    best = min((c.bic for c in result.candidates if c.fit), default=0.0)
    rows = [
        (c.model, f"{c.fit.fit.count}", f"{c.fit.relative_rms:.2%}", f"{c.bic - best:.1f}", c.against)
        if c.fit
        else (c.model, "", "", "", c.against)
        for c in result.candidates
    ]
    header = ("model", "parameters", "rms of abs(Z)", "BIC above the best", "against it")
    chosen = frozenset(k for k, c in enumerate(result.candidates) if c.model == result.model)
    return Grid(header, rows, words=frozenset({0, 4}), marked=chosen)


@page_of.register
def _(result: JointFit, command: str) -> Page:
    sources = list(dict.fromkeys(r.source for r in result.records))
    worst = max(result.records, key=lambda r: r.joint / r.size)
    facts = [
        ("model", result.model),
        ("files", f"{len(sources)}"),
        ("largest rms of the residuals", f"{worst.joint / worst.size:.2%} ({worst.source}, {worst.quantity})"),
    ]
    names, matrix = result.fit.names, result.fit.correlations()
    pairs = {f"{names[b]}, {names[a]}": float(matrix[b, a]) for a in range(len(names)) for b in range(a)}
    notes = [Prose(line) for line in comparison_notes(result)]
    sections = [
        Section(
            "Data, joint fit, prediction from the others, residuals",
            [picture(joint_figure(result), "measurements, the joint fit, the prediction from the others, residuals")],
        ),
        Section("What is left of every record", [_records(result), *notes]),
        *([Section("Candidates", [_joint_candidates(result)])] if result.candidates else []),
        parameter_section(result.parameters),
        *[parameter_section(found, f"Parameters of {source} by itself") for source, found in result.own.items()],
        derived_section(result.derived),
        Section("Autocorrelation of the residuals", [autocorrelation_picture(_residuals(result))]),
        correlation_section(names, pairs),
        *circuit_sections(result.actuator, result.to_json()["statistics"]),
        repetition(command or f"ilg-circuit identify {' '.join(sources)}", _engine(result.engine)),
    ]
    return Page(", ".join(sources), f"{files(result)} of one strip, fitted together", facts, result.warnings, sections)


def _records(result: JointFit) -> Grid:
    rows = [
        (
            r.source,
            r.quantity,
            format_quantity(r.voltage, "V", 4),
            f"{r.own / r.size:.2%}",
            f"{r.joint / r.size:.2%}",
            f"{r.predicted / r.size:.2%}" if r.predicted is not None else "",
        )
        for r in result.records
    ]
    header = ("record", "quantity", "voltage", "own fit", "joint fit", "from the others")
    return Grid(header, rows, words=frozenset({0, 1}))


def _joint_candidates(result: JointFit) -> Grid:
    best = min((c.bic for c in result.candidates if c.bic is not None), default=0.0)
    rows = [
        (c.model, f"{c.count}", f"{c.misfit:.2%}", f"{c.bic - best:.1f}", c.verdict)
        if c.bic is not None and c.misfit is not None
        else (c.model, "", "", "", c.verdict)
        for c in result.candidates
    ]
    header = ("model", "parameters", "rms", "BIC above the best", "verdict")
    chosen = frozenset(k for k, c in enumerate(result.candidates) if c.model == result.model)
    return Grid(header, rows, words=frozenset({0, 4}), marked=chosen)


def _residuals(result: JointFit) -> list[tuple[str, Array]]:
    """Residuals of every record; of an impedance both parts, over abs(Z)."""
    found: list[tuple[str, Array]] = []
    for r in result.records:
        if r.quantity == "impedance":
            relative = r.residuals / np.abs(r.data)
            found += [(f"{r.source}, real part", relative.real), (f"{r.source}, imaginary part", relative.imag)]
        else:
            found.append((f"{r.source}, {r.quantity}", r.residuals))
    return found


def _engine(engine: str) -> Sequence[str]:
    """The circuit solver's version, where it was in the loop."""
    if engine != "ngspice":
        return ()
    from ..solve.ngspice import session

    return (f"ngspice {session().version}",)
