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


def progress_bar(unit: str = "run") -> Progress:
    """A bar that is told (done, total), and closes when all is done."""
    from tqdm import tqdm

    bar = tqdm(total=None, delay=1.0, disable=None, leave=False, unit=unit)

    def advance(done: int, total: int) -> None:
        bar.total = total
        bar.update(done - bar.n)
        if done >= total:
            bar.close()

    return advance
