"""Progress on stderr: shown when the work takes more than a second, and only in a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def evaluation_counter() -> Iterator[Callable[[], None]]:
    """Yield a counter of model evaluations, for a fit whose number of them is unknown."""
    with _bar(unit="evaluation", desc="fitting") as bar:
        yield lambda: bar.update()


@contextmanager
def simulation_counter() -> Iterator[Callable[[int], None]]:
    """Yield a counter of simulations, for a search whose number of them is unknown."""
    with _bar(unit="simulation", desc="searching") as bar:
        yield lambda count: bar.update(count)


def progress_bar(unit: str = "run", *, begun: bool = False, desc: str | None = None) -> Callable[[float, float], None]:
    """Return a bar that is called with (done, total), and closes when all is done.

    ``begun``: its first call comes before any work; what is done then was done earlier and does not count for the time
    left.
    """
    bar = _bar(unit=unit, desc=desc, total=None)

    def advance(done: float, total: float) -> None:
        nonlocal begun
        bar.total = total
        if begun:
            begun, bar.initial, bar.n = False, done, done
        bar.update(done - bar.n)
        if bar.total is not None and done >= bar.total:
            bar.close()

    return advance


def _bar(**how: Any) -> Any:
    from tqdm import tqdm

    return tqdm(delay=1.0, disable=None, leave=False, **how)
