"""A netlist as text, a deck or a subcircuit, which can be saved and shown."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any, Self

from ..errors import InputError
from ..files import require_writable, write_text
from ..provenance import Provenance
from .netlist import plain

#: Lines of a text that a notebook shows at once.
_SHOWN = 6
#: Endings of the names of files by what is in them.
DECK, SUBCIRCUIT = (".cir", ".sp", ".spice", ".net", ".ckt"), (".lib", ".sub", ".inc", ".mod")


class SpiceText(str):
    """The text of a SPICE deck or subcircuit: a `str` with `save`, a short repr and ``warnings``.

    ``suffixes`` are those of a file of it, the usual one first.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> deck = ilg.netlist("paper", "step:4V", "300 s")
    >>> isinstance(deck, str), deck.suffixes[0], deck.splitlines()[-1]
    (True, '.cir', '.end')
    """

    suffixes: tuple[str, ...]
    warnings: tuple[str, ...]
    provenance: Provenance

    def __new__(
        cls,
        text: str,
        suffixes: tuple[str, ...] = DECK,
        warnings: tuple[str, ...] = (),
        provenance: Provenance | None = None,
    ) -> Self:
        found = super().__new__(cls, text)
        found.suffixes, found.warnings = suffixes, warnings
        found.provenance = provenance or Provenance()
        return found

    def __getnewargs__(self) -> tuple[Any, ...]:
        return str(self), self.suffixes, self.warnings, self.provenance

    def __str__(self) -> str:
        """Return the plain text."""
        return "".join(self)

    def with_provenance(self, provenance: Provenance) -> Self:
        """Return the text with its origin in comments after the title line."""
        text = str(self)
        place = text.index("\n", text.index("* written by ")) + 1
        added = "".join(f"* {plain(line)}\n" for line in provenance.lines()[1:])
        return type(self)(text[:place] + added + text[place:], self.suffixes, self.warnings, provenance)

    def save(self, path: str | Path) -> None:
        """Write the text to a file.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written, or its suffix is not one of ``suffixes``.
        """
        target = Path(path)
        if target.suffix.lower() not in self.suffixes:
            *most, last = self.suffixes
            raise InputError(f"cannot save '{path}': {self._what()} ends in {', '.join(most)} or {last}")
        require_writable(target)
        write_text(target, str(self))

    def summary(self) -> str:
        """Return in a line what the text is."""
        title = next((line.strip("* ") for line in self.splitlines() if line.strip("* ")), "")
        return f"{self._what()} of {len(self.splitlines())} lines: {title}"[:110]

    def __repr__(self) -> str:
        """Return what the text is; the text itself is ``print(text)``."""
        return f"<{self.summary()}; print it, or save it as {self.suffixes[0]}>"

    def _repr_html_(self) -> str:
        lines = self.splitlines()
        shown = escape("\n".join([*lines[:_SHOWN], f"... {len(lines) - _SHOWN} lines more"]))
        return f"<div><b>{escape(self.summary())}</b><pre>{shown}</pre></div>"

    def _what(self) -> str:
        return "SPICE deck" if self.suffixes == DECK else "SPICE subcircuit"
