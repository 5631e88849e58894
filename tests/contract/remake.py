"""Make the reference values of the contract again: ``python tests/contract/remake.py [name ...]``.

Without names all runs are made again, and with them the lists of options and of keys; with names only those runs. A
later change of a reference value is remade in the same commit that says why.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

# As in tests/conftest.py, before numpy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

from runs import RUNS, families, options, perform

REFERENCE = Path(__file__).with_name("reference")


def dumps(value: Any, indent: str = "") -> str:
    """JSON with a line for every entry of a dict, and lists of plain values on one line."""
    inner = indent + " "
    if isinstance(value, dict) and value:
        rows = [f"{inner}{json.dumps(key)}: {dumps(item, inner)}" for key, item in value.items()]
        return "{\n" + ",\n".join(rows) + f"\n{indent}}}"
    if isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        return "[\n" + ",\n".join(inner + dumps(item, inner) for item in value) + f"\n{indent}]"
    return json.dumps(value, allow_nan=False)


def main(names: list[str]) -> None:
    """Remake the runs called ``names``, or everything."""
    unknown = set(names) - {run.name for run in RUNS}
    if unknown:
        sys.exit(f"no run is called {', '.join(sorted(unknown))}; there are {', '.join(run.name for run in RUNS)}")
    REFERENCE.mkdir(exist_ok=True)
    performed = {}
    for run in RUNS:
        if names and run.name not in names:
            continue
        begun = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            performed[run.name] = perform(run, Path(folder))
        print(f"{run.name:<24}{time.perf_counter() - begun:6.2f} s", flush=True)
        write(run.name, performed[run.name])
    if not names:
        write("options", options())
        write("keys", families(performed))


def write(name: str, content: Any) -> None:
    (REFERENCE / f"{name}.json").write_text(dumps(content) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
