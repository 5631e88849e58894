"""Makes the notebooks of the examples: `examples/NAME.py` -> `examples/notebooks/NAME.ipynb`, the same cells.

python scripts/make_notebooks.py
"""

from __future__ import annotations

from pathlib import Path

import jupytext
from nbformat import NotebookNode

EXAMPLES = Path(__file__).parents[1] / "examples"


def notebook(script: Path) -> NotebookNode:
    """Return the notebook of a script, without outputs; cells are numbered, so that it is the same every time."""
    made = jupytext.read(script)
    made.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    for number, cell in enumerate(made.cells):
        cell.id, cell.metadata = f"cell-{number}", {}
    return made


if __name__ == "__main__":
    for script in sorted(EXAMPLES.glob("*.py")):
        jupytext.write(notebook(script), EXAMPLES / "notebooks" / f"{script.stem}.ipynb")
