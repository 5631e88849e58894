"""Reproduction of both papers' tables and figures by our own runs, compared with the printed ones.

In: the tables of ``data/``. Out: pages, pictures and verdicts. May import: every room but `commands`.
"""

from .catalogue import ITEMS, select
from .items import Check, Claim, Item, Outcome, Reproduction, Row
from .run import output_folder, run, write

__all__ = [
    "ITEMS",
    "Check",
    "Claim",
    "Item",
    "Outcome",
    "Reproduction",
    "Row",
    "output_folder",
    "run",
    "select",
    "write",
]
