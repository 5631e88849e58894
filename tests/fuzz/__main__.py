"""Long runs of the fuzz: ``python tests/fuzz commands 20000`` or ``files 50000``, resumed where they stopped.

Each case is made from its number alone. ``--state FILE`` keeps how far the run came and every fault as a line of JSON;
``--only N`` runs one case and prints its fault.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent / "contract"), str(HERE.parents[1])]

import fuzz_case  # noqa: E402 - found by the path above
import fuzz_lines  # noqa: E402


def main() -> int:
    options = argparse.ArgumentParser(prog="python tests/fuzz", description=__doc__)
    options.add_argument("what", choices=["commands", "files"])
    options.add_argument("count", type=int, nargs="?", default=1000, help="cases 0 to COUNT - 1")
    options.add_argument("--state", type=Path, help="file of JSON lines that a later run goes on from")
    options.add_argument("--only", type=int, help="run this case alone")
    given = options.parse_args()
    known = given.state.read_text().splitlines() if given.state and given.state.exists() else []
    first = max((json.loads(line)["next"] for line in known), default=0)
    cases = range(first, given.count) if given.only is None else [given.only]
    outcomes: Counter[str] = Counter()
    case = fuzz_case.run_command if given.what == "commands" else fuzz_case.read_damaged
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if given.what == "commands":
            fuzz_case.write_inputs(folder)
            fuzz_case.warm()
        for seed in cases:
            found = case(seed, folder)
            came = "ended by its time limit" if found.limited else f"exit {found.code}"
            outcomes["wrong" if found.wrong else came] += 1
            if found.wrong:
                line = fuzz_lines.command_line(seed) if given.what == "commands" else []
                print(f"case {seed}: {' '.join(line)[:400]!r}\n{found.wrong}", flush=True)
            if given.state and given.only is None and (found.wrong or seed % 50 == 49 or seed == cases[-1]):
                entry = {"next": seed + 1} | ({"case": seed, "wrong": found.wrong} if found.wrong else {})
                with given.state.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(entry) + "\n")
    print(f"cases {first} to {given.count - 1}: {dict(outcomes)}" if given.only is None else dict(outcomes))
    return 1 if outcomes["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
