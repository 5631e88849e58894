"""Runs notebooks in one kernel, which takes as long to start as most of them to run.

python run_notebooks.py FOLDER NOTEBOOK...     prints the name of each that ended well
"""

from __future__ import annotations

import sys
from pathlib import Path

import nbformat
from jupyter_client.manager import start_new_kernel
from nbclient import NotebookClient

folder, *books = map(Path, sys.argv[1:])
manager, client = start_new_kernel(kernel_name="python3")
client.stop_channels()
for path in books:
    book = nbformat.read(path, as_version=4)
    first = f"%reset -f\nimport os, sys\nos.chdir({str(folder)!r})\nsys.path[:] = {sys.path!r}"
    book.cells.insert(0, nbformat.v4.new_code_cell(first))
    NotebookClient(book, km=manager, timeout=120).execute()
    outputs = [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]
    assert outputs, f"{path.name} shows nothing"
    print(path.stem, flush=True)
manager.shutdown_kernel(now=True)
