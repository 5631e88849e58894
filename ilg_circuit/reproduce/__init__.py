"""Both papers' tables and figures, remade by our own runs and compared with what is printed.

In: the tables of ``data/``. Out: pages, pictures and verdicts. May import: every room but `commands`.
"""

from .catalogue import ITEMS, chosen
from .items import Check, Claim, Item, Made, Outcome, Row
from .making import make, prepared, write

__all__ = ["ITEMS", "Check", "Claim", "Item", "Made", "Outcome", "Row", "chosen", "make", "prepared", "write"]
