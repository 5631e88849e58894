"""The example scripts and their notebooks, which travel in the wheel; a checkout has them beside the package."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError, argument, unknown_name
from ..files import replacing


def folder() -> Path:
    """Return the folder of the examples. Raises InputError where it is missing."""
    here = Path(__file__).parents[1]
    for place in (here / "examples", here.parent / "examples"):
        if any(place.glob("*.py")):
            return place
    raise InputError(f"the examples are not in '{here / 'examples'}'; install the package again")


def titles() -> dict[str, str]:
    """Return what each example shows, by its name."""
    return {script.stem: _title(script) for script in sorted(folder().glob("*.py"))}


def copy_examples(names: Sequence[str], out: Path, *, force: bool = False) -> list[Path]:
    """Copy examples into a folder, made if absent, and return the files: script, notebook, and what a script reads.

    All examples if there are no ``names``. Raises InputError for an unknown name, and for a file that is there with
    another content unless ``force``.
    """
    place = folder()
    known = titles()
    for name in names:
        if name not in known:
            raise unknown_name("example", name, known)
    chosen = [file for name in names or known for file in _files(place, name)]
    files = {out / file.relative_to(place): file.read_bytes() for file in dict.fromkeys(chosen)}
    for path, content in files.items():
        if path.is_file() and path.read_bytes() != content and not force:
            way = f"give {argument('force')} to replace it, or another {argument('out')}"
            raise InputError(f"'{path}' is there, with another content; {way}")
    for path, content in files.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"cannot make the folder '{path.parent}': {error.strerror or error}") from None
        with replacing(path) as temporary:
            temporary.write_bytes(content)
    return list(files)


def _files(place: Path, name: str) -> list[Path]:
    """Return an example's script and notebook, and the files of the folder that the script names."""
    script = place / f"{name}.py"
    text = script.read_text(encoding="utf-8")
    others = [p for p in sorted(place.rglob("*")) if p.is_file() and p.suffix not in (".py", ".ipynb", ".pyc")]
    read = [path for path in others if path.name in text]
    return [script, *sorted(place.rglob(f"{name}.ipynb")), *read]


def _title(script: Path) -> str:
    """Return the first line of a script's docstring, or its first heading of Markdown."""
    text = script.read_text(encoding="utf-8")
    told = ast.get_docstring(ast.parse(text))
    heading = re.search(r"^# #+ (.+)$", text, flags=re.MULTILINE)
    return told.splitlines()[0] if told else heading[1] if heading else ""
