"""Checks the docstrings of the front door with numpydoc: sections, parameters, returns, examples.

python scripts/validate_docstrings.py     prints what is wrong, a line each; exit code 1 if anything is
"""

from __future__ import annotations

import sys

from numpydoc.validate import validate

import ilg_circuit as ilg

#: House style: the text begins on the first line; a sentence may need more than one line; nothing links to others.
ALLOWED = {"GL01", "GL02", "GL03", "SA01", "ES01", "RT03", "SS06", "PR06"}


def main() -> int:
    """Print what is wrong with the docstrings of ``ilg_circuit.__all__`` and return the exit code."""
    wrong = [
        f"ilg_circuit.{name}: {code} {text}"
        for name in ilg.__all__
        if callable(getattr(ilg, name)) and not isinstance(getattr(ilg, name), type)
        for code, text in validate(f"ilg_circuit.{name}")["errors"]
        if code not in ALLOWED
    ]
    print(*wrong, sep="\n")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
