"""The base of every result: plain data, whose text, picture and page are made in `report` when asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from .files import write_csv
from .provenance import Provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .report.page import Page


@dataclass(frozen=True)
class Result:
    """What a command or a call of the front door returns; ``provenance`` says where it comes from.

    A subclass names in ``presenter`` the module of `ilg_circuit.report` that shows it: its functions ``summary``,
    ``figure`` and ``page`` take the result.
    """

    presenter: ClassVar[str]
    provenance: Provenance = field(default_factory=Provenance, kw_only=True, compare=False, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data, ready for JSON."""
        raise TypeError(f"{type(self).__name__} has no plain form")

    def columns(self) -> Mapping[str, Iterable[Any]]:
        """Return the result as columns of one length, by header."""
        raise TypeError(f"{type(self).__name__} has no columns")

    def write_csv(self, path: str | Path) -> None:
        """Write the columns with full precision."""
        write_csv(path, self.columns())

    def summary(self) -> str:
        """Return the result as text for a terminal."""
        return self._presented("summary")

    def figure(self) -> Figure:
        """Return the result as a picture; nothing is shown or saved."""
        return self._presented("figure")

    def page(self) -> Page:
        """Return the result as a page of HTML sections; `report.page.write_page` writes it."""
        return self._presented("page")

    def _presented(self, how: str) -> Any:
        module = import_module(f"{__package__}.report.{self.presenter}")
        return getattr(module, how)(self)
