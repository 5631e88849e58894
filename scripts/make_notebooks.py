"""Makes the notebooks of the examples: `examples/NAME.py` -> `examples/notebooks/NAME.ipynb`, the same cells.

python scripts/make_notebooks.py
"""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

from sphinx_gallery.gen_gallery import DEFAULT_GALLERY_CONF
from sphinx_gallery.notebook import jupyter_notebook
from sphinx_gallery.py_source_parser import remove_config_comments, split_code_and_text_blocks

EXAMPLES = Path(__file__).parents[1] / "examples"


def notebook(script: Path) -> dict[str, Any]:
    """Return the notebook of a script, without outputs; cells are numbered, so that it is the same every time."""
    blocks = [
        block._replace(content=remove_config_comments(block.content)) if block.type == "code" else block
        for block in split_code_and_text_blocks(str(script))[1]
    ]
    made: dict[str, Any] = jupyter_notebook(blocks, copy.deepcopy(DEFAULT_GALLERY_CONF), str(EXAMPLES))
    made["metadata"] = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    made["nbformat_minor"] = 5
    for number, cell in enumerate(made["cells"]):
        cell["id"], cell["metadata"] = f"cell-{number}", {}
    return made


def text(script: Path) -> str:
    """Return the notebook of a script as its file holds it."""
    return json.dumps(notebook(script), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for script in sorted(EXAMPLES.glob("*.py")):
        (EXAMPLES / "notebooks" / f"{script.stem}.ipynb").write_text(text(script), encoding="utf-8")
