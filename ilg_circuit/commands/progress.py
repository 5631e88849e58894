"""Progress on stderr: shown when the work takes more than a second, and only in a terminal."""

from __future__ import annotations


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

        shape = {"unit": unit} if unit else {"bar_format": "{l_bar}{bar}"}
        self._bar = tqdm(total=total, delay=1.0, disable=None, leave=False, desc=doing, **shape)
        self._begun = begun

    def __call__(self, done: float, total: float | None = None) -> None:
        """Show that ``done`` of ``total`` is done."""
        bar = self._bar
        if total is not None:
            bar.total = total
        if self._begun:
            self._begun, bar.initial, bar.n = False, done, done
        bar.update(done - bar.n)
        if bar.total is not None and done >= bar.total:
            bar.close()

    def count(self, number: int = 1) -> None:
        """Show that ``number`` more are done."""
        self._bar.update(number)

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.close()
