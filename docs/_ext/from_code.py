"""Directives that write reference pages from the code: registries, findings, keys of files, the front door."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable
from dataclasses import MISSING, fields
from importlib import import_module
from pathlib import Path
from typing import ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import ilg_circuit as ilg
from ilg_circuit.arms.motion import Motion
from ilg_circuit.arms.run import ArmResult
from ilg_circuit.commands import COMMANDS
from ilg_circuit.findings import SENTENCES
from ilg_circuit.fit.result import FitResult
from ilg_circuit.hyperelastic.characterisation import Characterisation
from ilg_circuit.identification.batch import Batch
from ilg_circuit.identification.frequency_response import BodeOfRecords
from ilg_circuit.identification.identification import Identification
from ilg_circuit.identification.sensing import SensingFit
from ilg_circuit.measurements.formats import BINARIES, FORMATS
from ilg_circuit.measurements.load_test import LoadTest
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.oscillators.entrainment import Entrainment
from ilg_circuit.oscillators.loop_run import ReflexRun, ReflexSweep
from ilg_circuit.oscillators.run import RhythmRun
from ilg_circuit.oscillators.sweep import RhythmSweep
from ilg_circuit.result import Result
from ilg_circuit.simulation.bode import Bode
from ilg_circuit.simulation.drives import CURRENT, FORMS
from ilg_circuit.simulation.impedance import Impedance
from ilg_circuit.simulation.response import Response
from ilg_circuit.simulation.sensing import Sensed
from ilg_circuit.strip.actuator import (
    Actuator,
    Coupling,
    Electrodes,
    Geometry,
    IonBranch,
    Layer,
    Material,
    Mounting,
    Sensing,
)
from ilg_circuit.strip.couplings import RelaxingCoupling
from ilg_circuit.strip.models.registry import ADDITIONS, MODELS
from ilg_circuit.study.design import DesignReport
from ilg_circuit.study.sweep import SweepResult

ROOT = Path(__file__).parents[2]
#: What users hold in their hands.
RESULTS = (
    *(Response, Impedance, Bode, BodeOfRecords, Sensed, Identification, Batch, FitResult, Characterisation),
    *(SensingFit, SweepResult, DesignReport, RhythmRun, RhythmSweep, ReflexRun, ReflexSweep, Entrainment, ArmResult),
    *(Motion, Record, Spectrum, LoadTest, Result, Actuator),
)


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown."""

    def line(cells: Iterable[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    head = list(head)
    return "\n".join([line(head), line("---" for _ in head), *(line(row) for row in rows)])


def drives() -> str:
    """Return the forms of a drive: an example of a voltage, one of a motion, and the meaning."""
    rows = [(f"`{form.examples[0]}`", f"`{form.examples[1]}`", form.meaning) for form in FORMS]
    rows.append((f"`{CURRENT.examples[0]}`", "–", CURRENT.meaning))
    return table(("voltage", "motion", "meaning"), rows)


def formats() -> str:
    """Return the file formats in the order in which a file is offered to them, with what each may hold."""
    rows = [(one.NAME, ", ".join(kind.name for kind in one.KINDS), "text") for one in FORMATS]
    rows += [(one.NAME, "as its text", "binary") for one in BINARIES]
    return table(("format", "holds", "kind of file"), rows)


def columns() -> str:
    """Return for each kind of data the quantities that its columns may hold, with units and names."""
    kinds = {kind.name: kind for one in FORMATS for kind in one.KINDS}
    parts = []
    for kind in kinds.values():
        rows = (
            (f"`{name}`", unit or "–", ", ".join(f"`{word}`" for word in words[:6]) + ", …" * (len(words) > 6))
            for name, (unit, words) in kind.quantities.items()
        )
        parts += [f"**{kind.name}**, such as `{kind.example}`:", table(("quantity", "SI unit", "names"), rows)]
    return "\n\n".join(parts)


def strip_keys() -> str:
    """Return every key of a strip's file by section, with unit, meaning, and whether it may be left out."""
    parts = []
    for section, kind in (
        ("[geometry]", Geometry),
        ("[material]", Material),
        ("[[material.further_branches]]", IonBranch),
        ("[coupling]", Coupling),
        ('[coupling] kind = "charge", kind = "voltage-relaxations"', RelaxingCoupling),
        ("[electrodes]", Electrodes),
        ("[mounting]", Mounting),
        ("[sensing]", Sensing),
        ("[[layers]]", Layer),
    ):
        rows = []
        for item in fields(kind):
            if not item.metadata:
                continue
            needed = item.default is MISSING and item.default_factory is MISSING
            default = "" if item.default in (None, MISSING, ()) else f"{item.default:g}"
            left_out = "required" if needed else default or "may be left out"
            unit = item.metadata.get("unit", item.metadata.get("each"))
            rows.append((f"`{item.name}`", unit or "–", item.metadata["meaning"], left_out))
        parts += [f"## `{section}`", table(("key", "unit", "meaning", "default"), rows)] if rows else []
    rows = [
        (f"`{p.name}`", p.unit or "–", p.meaning, model.name)
        for model in (*MODELS.values(),)
        for p in model.material
        if p.name not in {item.name for item in fields(Material)}
    ]
    rows += [
        (f"`{a.parameter.name}`", a.parameter.unit or "–", a.parameter.meaning, f"+{a.name}")
        for a in ADDITIONS.values()
        if a.parameter.name not in {item.name for item in fields(Material)}
    ]
    parts += ["## Further keys of models, in `[material]`", table(("key", "unit", "meaning", "model"), rows)]
    return "\n\n".join(parts)


def findings() -> str:
    """Return every code of a finding with its sentence; names in italics are filled with what was found."""

    def shown(sentence: str) -> str:
        options = re.sub(
            r"\{(--[\w-]+)\}",
            r"`\1`",
            re.sub(r"\{(--[\w-]+):([^}]*)\}", r"`\1 \2`", re.sub(r"([*_<])", r"\\\1", sentence)),
        )
        return re.sub(r"\{([\w\\]+)(?:[^{}]|\{[^{}]*\})*\}", r"*\1*", options)

    return table(("code", "sentence"), ((f"`{code}`", shown(text)) for code, text in SENTENCES.items()))


def front_door() -> str:
    """Return the documentation of every public name."""
    parts = []
    for name in ilg.__all__:
        thing = getattr(ilg, name)
        kind = "autofunction" if not isinstance(thing, type) and callable(thing) else "autoexception"
        if name == "PAPER":
            continue
        parts.append(f"## {name}\n\n```{{eval-rst}}\n.. {kind}:: ilg_circuit.{name}\n```")
    return "\n\n".join(parts)


def results() -> str:
    """Return the documentation of what the front door's functions return, and of a strip."""
    return "\n\n".join(
        f"## {kind.__name__}\n\n```{{eval-rst}}\n.. autoclass:: {kind.__module__}.{kind.__name__}\n   :members:\n"
        f"   :no-index-entry:\n```"
        for kind in RESULTS
    )


def commands() -> str:
    """Return the documentation of every command: its help, examples and options."""
    parts = []
    for name in COMMANDS:
        module = import_module(f"ilg_circuit.commands.{name}")
        examples = "\n".join(f"ilg-circuit {example}" for example in getattr(module, name).examples)
        parts += [
            f"```{{eval-rst}}\n.. click:: {module.__name__}:{name}\n   :prog: ilg-circuit {name}\n```",
            f"**Examples of `{name}`**\n\n```bash\n{examples}\n```" if examples else "",
        ]
    return "\n\n".join(parts)


def misprints() -> str:
    """Return what cannot stand as the papers print it."""
    rows = (
        (f"{row['paper']} {row['where']}", row["printed"], row["correct"] or "–", row["reason"])
        for row in _rows("misprints.csv")
    )
    return table(("where", "printed", "correct", "why"), rows)


def recomputed() -> str:
    """Return the numbers that differ from what the papers print, with the reason."""
    files = ("ec_table1.csv", "ec_table2.csv", "ec_table3.csv", "ec_curves.csv", "ec_points.csv", "cpg_rhythm.csv")
    rows = (
        (
            row["item"],
            row["equation_or_table"],
            f"{row['printed'] or '–'} {row['unit']}",
            row["recomputed"],
            row["reason"],
        )
        for file in files
        for row in _rows(file)
        if row["reason"] and row["recomputed"]
    )
    return table(("item", "where", "printed", "recomputed", "why"), rows)


def _rows(file: str) -> list[dict[str, str]]:
    with (ROOT / "data" / file).open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


class FromCode(SphinxDirective):
    """``{from-code} NAME``: what the function of that name returns, read as Markdown."""

    required_arguments = 1
    known: ClassVar[dict[str, Callable[[], str]]] = {
        one.__name__: one
        for one in (
            drives,
            formats,
            columns,
            strip_keys,
            findings,
            front_door,
            results,
            commands,
            misprints,
            recomputed,
        )
    }

    def run(self) -> list[nodes.Node]:
        made: list[nodes.Node] = self.parse_text_to_nodes(self.known[self.arguments[0]](), allow_section_headings=True)
        return made


class Drawing(SphinxDirective):
    """``{drawing} NAME``: a drawing of `drawings/` within the page, with its meaning below."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        path = ROOT / "docs" / "drawings" / f"{self.arguments[0]}.svg"
        self.env.note_dependency(path)
        drawn = path.read_text(encoding="utf-8")
        meaning = re.search(r"<desc[^>]*>(.*)</desc>", drawn)
        assert meaning is not None
        return [
            nodes.raw("", f'<div class="ilg-drawn">{drawn}</div><p class="ilg-caption">{meaning[1]}</p>', format="html")
        ]


class ExamplePicture(SphinxDirective):
    """``{example-picture} NAME``: the first picture of an example, where the gallery was run."""

    required_arguments = 1
    option_spec: ClassVar[dict[str, Callable[[str], str]]] = {"alt": str}

    def run(self) -> list[nodes.Node]:
        name = self.arguments[0]
        path = ROOT / "docs" / "gallery" / "images" / f"sphx_glr_{name}_001.png"
        if not path.is_file():
            return []
        link = f"/gallery/images/{path.name}"
        lines = f"```{{image}} {link}\n:alt: {self.options['alt']}\n:class: ilg-picture\n```"
        made: list[nodes.Node] = self.parse_text_to_nodes(lines)
        return made


def escape(app: Sphinx, context: object, lines: list[str]) -> None:
    """Escape the asterisks of a command's help, which is no reStructuredText."""
    lines[:] = [line if line.lstrip().startswith(".. ") else line.replace("*", "\\*") for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive ``from-code``."""
    app.add_directive("from-code", FromCode)
    app.add_directive("drawing", Drawing)
    app.add_directive("example-picture", ExamplePicture)
    for part in ("description", "arguments", "options", "epilog"):
        app.connect(f"sphinx-click-process-{part}", escape)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
