"""Decks of a kit for what a fit left open: its corners, and a Monte Carlo from its covariance."""

from __future__ import annotations

from collections.abc import Sequence

from ..circuit.deck import transient_lines
from .decks import Plan, finished, steps
from .subcircuit import NAME
from .tolerances import Tolerances

#: How far corners are away, in standard errors.
SIGMAS = 2.0
#: Strips of a Monte Carlo, and the seed of their numbers.
COUNT, SEED = 50, 1
#: Below this part of the strip's own position and current a spread is not told from nothing.
_FLOOR = 1e-6
#: Steps so many times as long as those of one strip, since there are many.
_COARSER = 4
#: Columns of a printed table.
_COLUMNS = 4


def corners(made: Plan, tolerance: Tolerances) -> str:
    """Return the deck of the strip as fitted and at the corners of its covariance."""
    names = [f"{name} {sign} {SIGMAS:g} standard errors" for name in tolerance.names for sign in ("+", "-")]
    numbers = tolerance.corners(SIGMAS)
    notes = [
        f"Each corner has one parameter {SIGMAS:g} standard errors off, the others where the covariance expects them.",
        "y0 is the strip as fitted, positions in mm; the currents are those of V0 and so on. Corners:",
        *(f"    y{k}: {name}" for k, name in enumerate(names, 1)),
    ]
    strips = [[0.0] * len(tolerance.names), *numbers.tolist()]
    quantities = [*(f"v(y{k})" for k in range(len(strips))), *(f"i(V{k})" for k in range(len(strips)))]
    tables = [" ".join(row) for row in _rows(quantities)]
    return finished(
        "Corners of the fit's covariance",
        notes,
        [
            f"Vdrive drive 0 {made.drive.spice(made.duration)}",
            *_strips(strips, 0),
            *transient_lines(made.duration, *_steps(made), *tables),
        ],
    )


def monte_carlo(made: Plan, tolerance: Tolerances) -> str:
    """Return the deck of strips drawn at random from the covariance, whose mean and spread it computes."""
    numbers = tolerance.draws(COUNT, SEED)
    all_of = range(1, COUNT + 1)

    def spread(name: str, deviation: str, scale: float) -> list[str]:
        each = (deviation.format(k) for k in all_of)
        squares = [f"B{name}{k} 0 {name}_squared i=({d})*({d})/{COUNT - 1}" for k, d in enumerate(each, 1)]
        root = f"B{name} {name} 0 v=sqrt(abs(v({name}_squared))+{(_FLOOR * scale) ** 2!r})"
        return [*squares, f"R{name} {name}_squared 0 1", root]

    return finished(
        f"Monte Carlo: {COUNT} strips drawn from the fit's covariance",
        [
            f"Their numbers z were drawn with seed {SEED}, then shifted and mixed so that their mean is 0 and their",
            "covariance 1 exactly: a small spread has no error of sampling.",
            "v(mean), v(spread): mean and standard deviation of the position, 1 V = 1 mm; v(mean_current) and",
            "v(spread_current): of the current, 1 V = 1 A. y1 and so on are the positions.",
        ],
        [
            f"Vdrive drive 0 {made.drive.spice(made.duration)}",
            *_strips(numbers.tolist(), 1),
            *(f"Gmean{k} 0 mean y{k} 0 {1 / COUNT!r}" for k in all_of),
            "Rmean mean 0 1",
            *(f"Fmean{k} 0 mean_current V{k} {1 / COUNT!r}" for k in all_of),
            "Rcurrent mean_current 0 1",
            *spread("spread", "v(y{},mean)", made.position),
            *spread("spread_current", "i(V{})-v(mean_current)", made.current),
            *transient_lines(made.duration, *_steps(made), "v(mean) v(spread)", "v(mean_current) v(spread_current)"),
        ],
    )


def _strips(numbers: Sequence[Sequence[float]], first: int) -> list[str]:
    """Return strips at node ``drive``, each with its numbers z, position yk and current through Vk."""
    lines = []
    for k, row in enumerate(numbers, first):
        given = " ".join(f"z{n}={z:.9g}" for n, z in enumerate(row, 1))
        lines += [f"V{k} drive p{k} 0", f"X{k} p{k} 0 0 y{k} {NAME} {given}"]
    return lines


def _steps(made: Plan) -> tuple[float, float]:
    step, longest = steps(made.duration)
    longest = _COARSER * longest
    if made.drive.angular_frequency():
        longest = min(longest, 0.01 / made.drive.angular_frequency())
    return step, longest


def _rows(quantities: Sequence[str]) -> list[Sequence[str]]:
    return [quantities[k : k + _COLUMNS] for k in range(0, len(quantities), _COLUMNS)]
