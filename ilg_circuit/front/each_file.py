"""Values for single files among several: by the file's name, or ``*`` for all others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from ..errors import InputError, argument

T = TypeVar("T")


def values_of(
    given: Mapping[str, T],
    sources: Sequence[object],
    what: str,
    among: Sequence[int] | None = None,
    kind: str = "the files",
) -> list[T | None]:
    """Return the value of every source, None where none was given.

    Parameters
    ----------
    given
        Path or name of a file -> its value; ``*`` -> the value for all others.
    sources
        Paths; what is not a path has no name.
    what
        What the values are, for errors.
    among
        Indices of the sources that may have one (default: all), which are a ``kind``.

    Raises
    ------
    InputError
        A name is not that of a source among these.
    """
    chosen = range(len(sources)) if among is None else among
    found: list[T | None] = [None] * len(sources)
    for name in sorted(given, key=lambda name: name != "*"):
        hit = [k for k in chosen if name == "*" or name in _names(sources[k])]
        if not hit:
            reason = "there is none" if name == "*" else f"'{name}' is not one of them"
            text = f"{'' if name == '*' else f'{name}='}{given[name]}"
            raise InputError(f"{argument(what, text)}: it is for {kind}, and {reason}")
        for k in hit:
            found[k] = given[name]
    return found


def by_file(texts: Sequence[str]) -> dict[str, str]:
    """Return the values of an option, given as VALUE or FILE=VALUE, by file; the value for all others as ``*``."""
    return {name or "*": value for name, _, value in (text.rpartition("=") for text in texts)}


def _names(source: object) -> tuple[str, ...]:
    return (str(source), Path(source).name) if isinstance(source, str | Path) else ()
