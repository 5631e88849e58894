"""A figure that the documentation states, measured again."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """``stated`` is a page's own wording, to the letter; ``measured`` what came out now, ``peer`` another's way."""

    stated: str
    measured: str
    peer: str = ""

    def row(self, script: str) -> str:
        """A line of the table."""
        cells = (" ".join(self.stated.split()), self.measured, self.peer or "–", f"`{script}`")
        return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
