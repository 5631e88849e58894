"""Ten thousand damaged files of every format that is read: only this package's own errors, none slower than a second.

    python benchmarks/damaged_files.py [COUNT]

A good file gets one to five things wrong (bytes, lines, cells lost, doubled, replaced; seeded), is written, looked at
and read as the command line would. Exits with 1 where anything else than a result or a one-line InputError comes of it.
"""

from __future__ import annotations

import sys
import tempfile
import time
import warnings
from collections import Counter
from contextlib import suppress
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"
SLOWEST = 1.0


def main(count: int) -> int:
    sys.path.insert(0, str(TESTS))
    from damage import damaged
    from format_texts import TEXTS
    from tqdm import tqdm

    from ilg_circuit.errors import InputError
    from ilg_circuit.measurements.read import read, read_load_test, read_record, read_spectrum

    kinds = (
        ("record", TEXTS["record"], read_record),
        ("spectrum", TEXTS["spectrum"], read_spectrum),
        ("load test", TEXTS["load test"], lambda path: read_load_test(path, "uniaxial")),
    )
    warnings.simplefilter("error")
    outcomes: Counter[str] = Counter()
    failures, slowest = [], 0.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s.txt"
        for _, formats, reader in kinds:  # what is imported at first use is no file's fault
            path.write_text(next(iter(formats.values()))(), encoding="utf-8")
            reader(path)
        for seed in tqdm(range(count), disable=None):
            kind, formats, reader = kinds[(0, 0, 1, 1, 2)[seed % 5]]
            path.write_bytes(damaged(seed, formats))
            begin = time.perf_counter()
            try:
                with suppress(InputError):
                    read(path, "uniaxial")
                reader(path)
                outcomes[f"{kind}: read"] += 1
            except InputError as error:
                outcomes[f"{kind}: refused"] += 1
                if "\n" in str(error) or len(str(error)) > 1500:
                    failures.append(f"seed {seed}, {kind}: not one line: {str(error)[:200]!r}")
            except Exception as error:  # any that is not the package's own is the fault looked for
                failures.append(f"seed {seed}, {kind}: {type(error).__name__}: {error}")
            taken = time.perf_counter() - begin
            slowest = max(slowest, taken)
            if taken > SLOWEST:
                failures.append(f"seed {seed}, {kind}: {taken:.2f} s")
    print(f"{count} damaged files: {dict(sorted(outcomes.items()))}; slowest {slowest:.2f} s")
    print("\n".join(failures[:20]) or "only this package's own errors")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000))
