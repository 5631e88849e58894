"""Linear terms for the unknown initial state of a strip whose record begins within a run.

The response to an initial state is a sum of exponentials with the model's rates and unknown coefficients. A dense grid
of rates spans all such responses; its few distinct combinations are linear terms of the fit for any model. A straight
line is among them where the offset is fitted too, since a drift of the instrument cannot be told from a slow decay.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array

#: Rates per decade, and least singular value, relative to the largest, of a combination that is used.
_A_DECADE, _COUNTS = 4, 1e-3


def decaying_terms(t: Array, *, centred: bool) -> Array:
    """Return orthogonal terms (samples, q) that decay from ``t`` = 0 [s] on; ``centred`` beside a constant term."""
    after = t[t > 0]
    if len(after) < 2:
        return np.zeros((len(t), 0))
    slowest, fastest = 0.5 / float(after[-1]), 1.0 / float(np.median(np.diff(after[:20])))
    count = 1 + int(np.ceil(_A_DECADE * np.log10(fastest / slowest)))
    rates = np.geomspace(slowest, fastest, count)
    terms = np.where(t[:, None] >= 0, np.exp(-rates * np.maximum(t, 0.0)[:, None]), 0.0)
    if centred:
        terms = np.column_stack([terms, t])
        terms -= terms.mean(axis=0)
    left, sizes, _ = np.linalg.svd(terms / np.linalg.norm(terms, axis=0), full_matrices=False)
    return np.asarray(left[:, sizes > _COUNTS * sizes[0]] * np.sqrt(len(t)))
