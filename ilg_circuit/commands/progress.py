"""Progress on stderr: a bar in a terminal after a second; elsewhere one line, where the work takes over ten seconds."""

from __future__ import annotations

import time

import click

#: Seconds of work from which its duration is announced, and after which an estimate of it is reliable.
_LONG, _ESTIMATED_AFTER = 10.0, 2.0


class ProgressBar:
    """A progress bar for work that reports ``bar(done, total)``, or that counts ``bar.count()``.

    ``unit`` is what is counted; without it only the share is shown. ``doing`` stands before the bar. ``total`` is the
    amount of work, where the reports do not say it. ``begun``: the first report comes before any work and says what
    was done earlier, which does not count for the time left. The bar vanishes when all is done, or at the end of a
    ``with`` block.
    """

    def __init__(
        self, unit: str = "run", *, doing: str | None = None, total: float | None = None, begun: bool = False
    ) -> None:
        from tqdm import tqdm

        shape = {"unit": unit} if unit else {"bar_format": "{l_bar}{bar}| {elapsed}<{remaining}"}
        self._bar = tqdm(total=total, delay=1.0, disable=None, leave=False, desc=doing, **shape)
        self._begun, self._doing, self._unit = begun, doing or "solving", unit
        self._start, self._earlier, self._done, self._told = time.monotonic(), 0.0, 0.0, not self._bar.disable

    def __call__(self, done: float, total: float | None = None) -> None:
        """Show that ``done`` of ``total`` is done."""
        bar = self._bar
        if total is not None:
            bar.total = total
        if self._begun:
            self._begun, self._earlier, bar.initial, bar.n = False, done, done, done
        bar.update(done - bar.n)
        if bar.total is not None and done >= bar.total:
            bar.close()
        self._tell(done)

    def count(self, number: int = 1) -> None:
        """Show that ``number`` more are done."""
        self._bar.update(number)
        self._tell(self._done + number)

    def _tell(self, done: float) -> None:
        """Print once, without a progress bar, how long the work will take, or that it takes long."""
        self._done, total = done, self._bar.total
        spent = time.monotonic() - self._start
        if self._told or spent < _ESTIMATED_AFTER or done <= self._earlier:
            return
        left = spent * (total - done) / (done - self._earlier) if total else 0.0
        if spent + left < _LONG or (total and left <= 0):
            return
        self._told = True
        known = f"about {left:.0f} s to go" if total else f"{done:.0f} {self._unit}s in {spent:.0f} s, and more to come"
        click.echo(f"{self._doing}: {known}", err=True)

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.close()
