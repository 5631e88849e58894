"""All items: tables, figures and equations of EC, then CPG.

Those that need the arm import it when they are made, so that all can be listed.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from ..errors import InputError
from . import cpg_rhythm, ec_curves, ec_equations, ec_sizes, ec_tables
from .items import Item, Reproduction
from .paper_runs import PaperRuns

_ARM = "ilg-circuit arm --rhythm ring --duration 1.5s"
_OUT = "--out motion.nc --plot motion.png"
#: Amplitude of the rhythm at e = 1, Tr = 0.12 s, to which every motion is referred; a test checks it.
REFERENCE = "--reference 0.50032"
_MOTION = (
    "M q″ = f<sub>springs</sub> + Gᵀp, &nbsp; cells of constant area; eigenstrain ε = 3 d(0) U/b · out/A<sub>ref</sub>"
)
_CIRCUIT = (
    "u = U clip(out/A<sub>ref</sub>, −1, 1) → circuit of the strip → ε = 3 d(s) v<sub>p</sub>/b; &nbsp; "
    "charge alone: ε = 3 d(0) U/b · q/(C U)"
)


def _later(module: str, function: str) -> Callable[[PaperRuns], Reproduction]:
    """Return ``function`` of a ``module`` that needs the arm, imported when called."""

    def make(runs: PaperRuns) -> Reproduction:
        made: Reproduction = getattr(import_module(f".{module}", __package__), function)(runs)
        return made

    return make


_ARM_ITEMS = (
    Item(
        "CPG-F10",
        "Figure 10: rhythm, phase portrait, motion, force",
        "Output and phase diagrams of the CPG (a), (b); motion trajectories at 0.5, 0.7, 1.0 and 1.5 s (c); internal "
        "force of the first section (d).",
        _MOTION,
        (f"{_ARM} {_OUT}",),
        _later("cpg_motion", "figure_10"),
        needs_arm=True,
    ),
    Item(
        "CPG-F11",
        "Figure 11: various e",
        "Output (a), phase curves (b) and motions (c) for e = (0, 4).",
        f"{_MOTION}; &nbsp; e → c e scales x, v, y by c and leaves the period",
        (
            f"{_ARM} --tonic 4 {REFERENCE} {_OUT}",
            "ilg-circuit cpg --topology ring --sweep tonic=1:50:50 --out sweep.csv --plot sweep.png",
        ),
        _later("cpg_motion", "figure_11"),
        needs_arm=True,
    ),
    Item(
        "CPG-F12",
        "Figure 12: various T_r",
        "Output (a), phase curves (b) and motions (c) for e = 1 and various T_r.",
        _MOTION,
        (f"{_ARM} --rise-time 0.3s {REFERENCE} {_OUT}",),
        _later("cpg_motion", "figure_12"),
        needs_arm=True,
    ),
    Item(
        "CPG-F13",
        "Figure 13: a parameter whose symbol is lost",
        "Output (a), phase curves (b) and motions (c) for e = 1, T_r = 0.1 s and various values of the parameter.",
        _MOTION,
        (
            f"{_ARM} --rise-time 0.1s --inhibition 3 {REFERENCE} {_OUT}",
            f"{_ARM} --rise-time 0.1s --adaptation 50 {REFERENCE} {_OUT}",
        ),
        _later("cpg_motion", "figure_13"),
        needs_arm=True,
    ),
    Item(
        "CPG-S",
        "Section 6.1: 15 and 30 segments",
        "",
        _MOTION,
        (f"{_ARM} --segments 15 {_OUT}", f"{_ARM} --segments 30 {_OUT}"),
        _later("cpg_motion", "segments"),
        needs_arm=True,
    ),
    Item(
        "CPG-C",
        "Figure 10(c) through the strip's circuit",
        "",
        _CIRCUIT,
        (
            f"ilg-circuit arm --coupling circuit --duration 1.5s {_OUT}",
            f"ilg-circuit arm --coupling circuit --slower 100 --duration 300s {_OUT}",
            f"ilg-circuit arm --coupling charge --duration 1.5s {_OUT}",
        ),
        _later("cpg_circuit", "circuit"),
        needs_arm=True,
    ),
    Item(
        "CPG-P",
        "Section 7: the positions that the arm can reach",
        "",
        "min over a, e, time scale of min<sub>t</sub> |tip(t) − target|",
        (f"ilg-circuit arm --reach 20mm,15mm --duration 6s {_OUT}",),
        _later("cpg_circuit", "reach"),
        needs_arm=True,
    ),
)

ITEMS: tuple[Item, ...] = (
    *ec_tables.ITEMS,
    *ec_curves.ITEMS,
    *ec_sizes.ITEMS,
    *ec_equations.ITEMS,
    *cpg_rhythm.ITEMS,
    *_ARM_ITEMS,
)


def select(only: str | None) -> tuple[Item, ...]:
    """Return the items of a list of ids such as ``EC-T1,EC-F9``, in the page's order; all without a list.

    Raises InputError naming an unknown id.
    """
    if only is None:
        return ITEMS
    wanted = {cell.strip().upper() for cell in only.split(",") if cell.strip()}
    if not wanted:
        raise InputError("--only names no item; write it like --only EC-T1,EC-F9 (--list shows all)")
    unknown = sorted(wanted - {item.id for item in ITEMS})
    if unknown:
        raise InputError(f"--only: there is no item '{unknown[0][:40]}'; --list shows all, such as EC-T1 or EC-F9")
    return tuple(item for item in ITEMS if item.id in wanted)
