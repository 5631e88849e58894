"""Computes what a slider asks for in a thread, always the newest wish, so that the window stays quick."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from ..errors import IlgError


class Live:
    """Calls ``compute`` with the newest wish and ``show`` with its answer or its `IlgError`, one at a time.

    Wishes that are outdated before their turn are skipped. ``show`` is called by ``soon``, in the window's thread.
    """

    def __init__(
        self,
        compute: Callable[..., Any],
        show: Callable[[Any], object],
        soon: Callable[[Callable[[], object]], object],
    ) -> None:
        self._compute, self._show, self._soon = compute, show, soon
        self._lock = threading.Lock()
        self._wish: tuple[Any, ...] | None = None
        self._running, self._era = False, 0
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="live")

    def want(self, *wish: Any) -> None:
        """Have this computed next."""
        with self._lock:
            self._wish = wish
            if self._running:
                return
            self._running = True
        self._pool.submit(self._work)

    def forget(self) -> None:
        """Show nothing of what was wanted until now."""
        with self._lock:
            self._wish, self._era = None, self._era + 1

    def _work(self) -> None:
        while True:
            with self._lock:
                wish, self._wish, era = self._wish, None, self._era
                if wish is None:
                    self._running = False
                    return
            found: Any
            try:
                found = self._compute(*wish)
            except IlgError as error:
                found = error
            except Exception as error:  # a fault of this package: told in one line, and the window stays
                found = IlgError(f"unexpected {type(error).__name__}: {error}")
            self._soon(partial(self._deliver, era, found))

    def _deliver(self, era: int, found: Any) -> None:
        if era == self._era:
            self._show(found)

    def close(self) -> None:
        """Compute nothing more."""
        self._pool.shutdown(wait=False, cancel_futures=True)
