"""Seeded damage to good files of any format."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ilg_circuit.errors import InputError

SCRAPS = (
    b"\0",
    b"nan",
    b"inf",
    b"-1e999",
    b",,,,",
    b"\t\t",
    b"\r",
    b"\xff\xfe",
    b"1_0",
    b"x" * 300,
    b"-",
    b"\n\n",
    b"#",
    b'"',
    b";",
    b"1e308",
    b"ZCURVE\tTABLE\n",
    b"CURVE\tTABLE\n",
    b"freq/Hz\t",
    b"Ewe/V\t",
    b"Nb header lines : 3\n",
    b"9" * 400,
)


def read_or_refused(
    path: Path, seeds: range, formats: Mapping[str, Callable[[], str]], read: Callable[[Path], None]
) -> Counter[str]:
    """How many damaged files were ``read`` and how many refused, in one line each, none in over 2 s of computing."""
    outcomes: Counter[str] = Counter()
    for seed in seeds:
        path.write_bytes(damaged(seed, formats))
        begin = time.process_time()
        said = ""
        try:
            read(path)
        except InputError as error:
            said = str(error)
        outcomes["refused" if said else "read"] += 1
        assert "\n" not in said, seed
        assert len(said) < 1500, seed
        assert time.process_time() - begin < 2, seed
    return outcomes


def damaged(seed: int, formats: Mapping[str, Callable[[], str]]) -> bytes:
    """A good file of one of the ``formats`` with one to five things wrong: bytes, lines, cells lost, doubled."""
    random = np.random.default_rng(seed)
    names = tuple(formats)
    text = formats[names[int(random.integers(len(names)))]]()
    data = text.encode("latin-1" if random.random() < 0.3 else "utf-8", errors="replace")
    for _ in range(int(random.integers(1, 6))):
        data = _damage(data, int(random.integers(9)), random)
    return data


def _damage(data: bytes, how: int, random: np.random.Generator) -> bytes:
    if not data:
        return data
    a, b = sorted(int(k) for k in random.integers(0, len(data) + 1, 2))
    lines = data.split(b"\n")
    j, k = (int(x) for x in random.integers(0, len(lines), 2))
    scrap = SCRAPS[int(random.integers(len(SCRAPS)))]
    if how == 0:
        return data[:a]
    if how == 1:
        return data[:a] + data[b:]
    if how == 2:
        return data[:a] + scrap + data[a:]
    if how == 3:
        return data[:a] + bytes(random.integers(0, 256, 4).astype(np.uint8)) + data[a + 4 :]
    if how == 4:
        lines[j], lines[k] = lines[k], lines[j]
    elif how == 5:
        lines[j : j + 1] = [lines[j]] * int(random.integers(2, 40))
    elif how == 6:
        del lines[min(j, k) : max(j, k)]
    elif how == 7:
        cells = lines[j].split(b"\t" if b"\t" in lines[j] else b",")
        cells[int(random.integers(len(cells)))] = scrap
        lines[j] = b",".join(cells)
    else:
        return data.replace(*((b"\t", b",") if random.random() < 0.5 else (b"E", b"e-")))
    return b"\n".join(lines)
