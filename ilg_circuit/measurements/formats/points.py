"""Selects one of the tracked points of a film."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError, argument


def point_of(labels: Sequence[str], wanted: str | None, name: str) -> str:
    """Return the label of the chosen point of a file, ignoring case.

    Raises
    ------
    InputError
        There are several and none was chosen, or the one chosen is not there; the message lists them.
    """
    found = [label for label in labels if wanted is None or label.lower() == wanted.lower()]
    if len(found) == 1:
        return found[0]
    listed = ", ".join(label[:40] for label in labels[:20])
    if wanted is not None:
        raise InputError(f"{name}: no point '{wanted[:40]}'; it tracks {listed}")
    raise InputError(f"{name}: tracks {len(labels)} points: {listed}; choose one with {argument('part', labels[-1])}")
