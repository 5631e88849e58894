"""Both papers' tables and figures, remade by our own runs and compared with what is printed."""

from .catalogue import ITEMS, chosen
from .items import Check, Claim, Item, Made, Outcome, Row
from .making import make, prepared, write

__all__ = ["ITEMS", "Check", "Claim", "Item", "Made", "Outcome", "Row", "chosen", "make", "prepared", "write"]
