"""Progress on stderr: shown when the work takes more than a second, and only in a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..solve.transient import Progress


@contextmanager
def evaluation_counter() -> Iterator[Callable[[], None]]:
    """A count of model evaluations, for a fit whose number of them nobody knows."""
    from tqdm import tqdm

    with tqdm(delay=1.0, disable=None, leave=False, unit="evaluation", desc="fitting") as bar:

        def advance() -> None:
            bar.update()

        yield advance


@contextmanager
def simulation_counter() -> Iterator[Callable[[int], None]]:
    """A count of simulations, for a search whose number of them nobody knows."""
    from tqdm import tqdm

    with tqdm(delay=1.0, disable=None, leave=False, unit="simulation", desc="searching") as bar:

        def advance(count: int) -> None:
            bar.update(count)

        yield advance


def progress_bar(unit: str = "run", *, begun: bool = False) -> Progress:
    """A bar that is told (done, total), and closes when all is done.

    ``begun``: it is told for the first time before any work, and what is done then was done earlier: it does not count
    for the time left.
    """
    from tqdm import tqdm

    bar = tqdm(total=None, delay=1.0, disable=None, leave=False, unit=unit)

    def advance(done: int, total: int) -> None:
        nonlocal begun
        bar.total = total
        if begun:
            begun, bar.initial, bar.n = False, done, done
        bar.update(done - bar.n)
        if done >= total:
            bar.close()

    return advance
