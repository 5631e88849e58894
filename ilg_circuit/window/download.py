"""A button that makes a file when it is pressed and hands it to the browser; an error is a line beneath it."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import panel as pn

from ..errors import IlgError
from .answers import box
from .look import shown


class _Refused(Exception):
    """The file cannot be made; the user has been told why."""


def _transfer(button: Any) -> None:
    """Send the file; nothing where it could not be made."""
    try:
        pn.widgets.FileDownload._transfer(button)
    except _Refused:
        return


#: Panel's button, with that in place of an error in the server.
_FileDownload: Any = type("FileDownload", (pn.widgets.FileDownload,), {"_transfer": _transfer})


class Download:
    """A button for a file ``name`` that ``write`` writes to a path; ``view`` is what Panel shows."""

    def __init__(self, label: str, name: str, write: Callable[[Path], object]) -> None:
        self.name, self._write = name, write
        self.line = shown()
        self.button = _FileDownload(callback=self.content, filename=name, label=label, sizing_mode="stretch_width")
        self.view = pn.Column(self.button, self.line, sizing_mode="stretch_width")

    def content(self) -> Any:
        """Return the file's content. Raises `_Refused`, after telling the user, where there is none."""
        self.line.object = ""
        with TemporaryDirectory(prefix="ilg_circuit_") as folder:
            path = Path(folder) / self.name
            try:
                self._write(path)
            except IlgError as error:
                self.line.object = box("error", str(error))
                raise _Refused from None
            return io.BytesIO(path.read_bytes())
