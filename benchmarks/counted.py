"""Keeps what long measurements count, block by block, so that a later call goes on where an earlier one stopped.

A block is some sets in a row of one kind. Its line in `counted/` says which commit counted it, so that a page can say
of which versions its figures are.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial, reduce
from pathlib import Path
from time import perf_counter
from typing import Any

from tqdm import tqdm

FOLDER = Path(__file__).with_name("counted")
#: Sets that are counted at a time.
SIZE = 20

#: Names to counts: whole numbers, the largest of other numbers, lists of what was found, or such a table again.
Counts = dict[str, Any]
#: Kind, first set and number of sets -> counts.
Measure = Callable[[str, int, int], Counts]


@dataclass(frozen=True)
class Block:
    """The ``counts`` of so many ``sets`` of a ``kind`` from the ``first`` on, as the code of a ``commit`` gave them."""

    kind: str
    first: int
    sets: int
    commit: str
    counts: Counts


def options(parser: argparse.ArgumentParser) -> None:
    """Add the options that `blocks` needs."""
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after so long, with what is done")
    parser.add_argument("--again", action="store_true", help="count all sets anew, and keep nothing")


def joined(one: Counts, other: Counts) -> Counts:
    """Return the counts of both: whole numbers and lists are added, of other numbers the largest counts."""
    both = dict(one)
    for name, more in other.items():
        own = both.get(name)
        if own is None:
            both[name] = more
        elif isinstance(more, dict):
            both[name] = joined(own, more)
        else:
            both[name] = max(own, more) if isinstance(more, float) else own + more
    return both


def summed(outcome: Callable[[str, int], Counts], kind: str, first: int, count: int) -> Counts:
    """Return the counts of ``count`` sets of a kind, from the ``first`` on, each of which ``outcome`` counts."""
    return reduce(joined, (outcome(kind, k) for k in range(first, first + count)))


def heading(title: str, document: str | None, found: Iterable[Block]) -> list[str]:
    """Return a page's first lines: its ``title``, what the script's ``document`` says of the sets, the versions."""
    about = (document or "").split("\n\n", 2)[2].strip().replace("\n", " ")
    return [f"# {title}", "", about, "", versions(found), ""]


def total(found: Iterable[Block], kind: str) -> Counts:
    """Return the counts of all blocks of a kind."""
    return reduce(joined, (block.counts for block in found if block.kind == kind), {})


def blocks(name: str, kinds: Sequence[str], sets: int, measure: Measure, given: argparse.Namespace) -> list[Block]:
    """Return the blocks of the first ``sets`` of each kind: those kept under ``name``, then those that are missing.

    These are added to what is kept. All kinds advance alike.
    """
    path = FOLDER / f"{name}.jsonl"
    kept = [] if given.again else _read(path)
    done = {kind: sum(block.sets for block in kept if block.kind == kind) for kind in kinds}
    missing = [(k, kind, min(SIZE, sets - k)) for kind in kinds for k in range(done[kind], sets, SIZE)]
    missing.sort(key=lambda one: one[0])
    found: list[Block] = []
    commit, begin = _commit(), perf_counter()
    pool = ProcessPoolExecutor(given.workers) if given.workers > 1 and missing else None
    try:
        counted = (pool.map if pool else map)(partial(_counted, measure), missing)
        for (first, kind, count), counts in zip(tqdm(missing, leave=False, disable=None), counted, strict=True):
            found.append(Block(kind, first, count, commit, counts))
            if not given.again:
                FOLDER.mkdir(exist_ok=True)
                with path.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(vars(found[-1])) + "\n")
            if perf_counter() - begin > 60 * given.minutes:
                break
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)
        if not given.again and found:
            _write(path, _read(path))
    return [block for block in kept if block.kind in kinds] + found


def _counted(measure: Measure, task: tuple[int, str, int]) -> Counts:
    first, kind, count = task
    return measure(kind, first, count)


def _read(path: Path) -> list[Block]:
    """Return the blocks of a file, those of a kind that one commit counted in a row as one."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    last: dict[str, Block] = {}
    whole: list[Block] = []
    for block in (Block(**json.loads(line)) for line in lines):
        before = last.get(block.kind)
        if before is not None and before.commit == block.commit:
            counts = joined(before.counts, block.counts)
            block = Block(block.kind, before.first, before.sets + block.sets, block.commit, counts)
        elif before is not None:
            whole.append(before)
        last[block.kind] = block
    return whole + list(last.values())


def _write(path: Path, found: Sequence[Block]) -> None:
    fresh = path.with_suffix(".new")
    fresh.write_text("".join(json.dumps(vars(block)) + "\n" for block in found), encoding="utf-8")
    fresh.replace(path)


def versions(found: Iterable[Block]) -> str:
    """Return which commits counted how many sets."""
    sets: Counter[str] = Counter()
    for block in found:
        sets[block.commit] += block.sets
    return "Counted by " + ", ".join(f"{commit} ({count:,} sets)" for commit, count in sets.items()) + "."


def _commit() -> str:
    try:
        commit, changed = _git("describe", "--always"), _git("status", "--porcelain", "--", "*.py", "*.toml")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return f"{commit}-dirty" if changed else commit  # counts and pages that are being written change no figure


def _git(*asked: str) -> str:
    whole = ["git", "-C", str(FOLDER.parents[1]), *asked]
    return subprocess.run(whole, capture_output=True, text=True, check=True).stdout.strip()
