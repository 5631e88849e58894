"""Catalogue of the items, read from ``items.toml``: tables, figures and equations of EC, then of CPG.

The module of an item is imported when the item is made: those that move the arm compile its kernels.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from ..errors import InputError
from .items import Claim, Item, Reproduction
from .paper_runs import PaperRuns

_ENTRIES = tomllib.loads(Path(__file__).with_name("items.toml").read_text(encoding="utf-8"))
#: Assumptions that several items share: name -> sentence.
_ASSUMED: dict[str, str] = _ENTRIES.pop("ASSUMED")


def _item(id_: str, entry: dict[str, Any]) -> Item:
    """Return an item; its function ``module.name`` of this package is imported when called, and gets its texts."""
    module, _, name = entry["function"].partition(".")
    claims = entry.get("claims", ())
    unknown = (*entry.get("unknown", ()), *(_ASSUMED[key] for key in entry.get("assumed", ())))

    def make(runs: PaperRuns) -> Reproduction:
        made: Reproduction = getattr(import_module(f".{module}", __package__), name)(runs)
        told = (
            Claim(claim["says"], holds, claim["found"].format(**made.numbers))
            for claim, holds in zip(claims, made.holds, strict=True)
        )
        return replace(made, claims=tuple(told), unknown=unknown)

    texts = {key: entry.get(key, "") for key in ("title", "caption", "equation")}
    return Item(id_, commands=tuple(entry["commands"]), make=make, needs_arm=entry.get("needs_arm", False), **texts)


ITEMS = tuple(_item(id_, entry) for id_, entry in _ENTRIES.items())


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
