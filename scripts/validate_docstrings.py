"""Checks docstrings with numpydoc: functions of the front door, and methods of the classes in `ilg_circuit.results`.

python scripts/validate_docstrings.py     prints what is wrong, a line each; exit code 1 if anything is
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from inspect import getmembers, isfunction

from numpydoc.validate import validate

import ilg_circuit as ilg

#: House style: the text begins on the first line; a sentence may need more than one line; nothing links to others.
ALLOWED = {"GL01", "GL02", "GL03", "SA01", "ES01", "RT03", "SS06", "PR06"}
#: Of methods: what the first line says needs no sections, and attributes are nouns.
OF_METHODS = ALLOWED | {"EX01", "PR01", "RT01", "YD01", "SS02"}


def main() -> int:
    """Print what is wrong with the docstrings and return the exit code."""
    functions = (f"ilg_circuit.{name}" for name in ilg.__all__ if isfunction(getattr(ilg, name)))
    wrong = [
        f"{name}: {code} {text}"
        for names, allowed in ((functions, ALLOWED), (sorted(set(methods())), OF_METHODS))
        for name in names
        for code, text in validate(name)["errors"]
        if code not in allowed
    ]
    print(*wrong, sep="\n")
    return bool(wrong)


def methods() -> Iterator[str]:
    """The public methods and properties of the classes of results that are defined in this package."""
    for name in ilg.results.__all__:
        for word, member in getmembers(getattr(ilg.results, name)):
            found = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
            if not word.startswith("_") and isfunction(found) and found.__module__.startswith("ilg_circuit"):
                yield f"{found.__module__}.{found.__qualname__}"


if __name__ == "__main__":
    sys.exit(main())
