"""The folder of a kit, written whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..drive import Drive
from ..files import KIT, replacing_folder, require_folder
from ..provenance import Provenance
from ..strip.actuator import Actuator
from . import decks, driver_decks, spread_decks, symbols
from .page import page
from .subcircuit import NAME, kit_library
from .tolerances import tolerances


def kit_texts(
    actuator: Actuator, drive: Drive, duration: float, beam: str | None = None, origin: Provenance | None = None
) -> dict[str, str]:
    """Return the files of a kit, name -> text.

    Raises InputError for a strip without coupling, or a drive without a voltage.
    """
    beam = actuator.beam(beam)
    tolerance = tolerances(actuator) if actuator.coupling is not None else None
    texts = {"strip.lib": kit_library(actuator, tolerance, beam)}
    made = decks.plan(actuator, drive, duration, beam)
    texts |= {
        "README.md": page(made, tolerance, beam, origin or Provenance()),
        "strip.kicad_sym": symbols.kicad(),
        f"{NAME}.asy": symbols.ltspice(),
        "op.cir": decks.operating_point(made),
        "ac.cir": decks.small_signal(made),
        "transient.cir": decks.response(made),
        "h_bridge.cir": driver_decks.h_bridge(made),
        "amplifier.cir": driver_decks.amplifier(made),
        "position_loop.cir": driver_decks.position_loop(made),
        "loop_gain.cir": driver_decks.loop_gain(made),
    }
    if tolerance is not None:
        texts["corners.cir"] = spread_decks.corners(made, tolerance)
        texts["monte_carlo.cir"] = spread_decks.monte_carlo(made, tolerance)
    return texts


def write_kit(
    path: Path,
    actuator: Actuator,
    drive: Drive,
    duration: float,
    beam: str | None = None,
    *,
    origin: Provenance | None = None,
    force: bool = False,
    inputs: Iterable[Path] = (),
) -> None:
    """Write the folder of a kit; one that is there is replaced only if it is a kit to which nothing was added.

    Raises InputError as `kit_texts` does, and for a folder that is not to be replaced unless by ``force``, or with
    ``inputs`` in it.
    """
    require_folder(path, force=force, inputs=inputs, kind=KIT)
    texts = kit_texts(actuator, drive, duration, beam, origin)
    with replacing_folder(path, {"strip": actuator.name}, force=force, kind=KIT) as folder:
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
