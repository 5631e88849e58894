"""What of an answer is compared with the reference, and how closely.

Everything in the reference must be in the answer; the answer may hold more keys, candidates and records. Versions and
calls, `IGNORED`, are not compared. Then:

- Numbers agree to the tolerance of the run's class, relative to their size: that of the number itself, the largest of
  an array or a table's column, 1 for correlations, the two standard errors for a covariance, the standard error of a
  fitted value that is smaller than it. A fitted value of a run with ngspice in the loop must besides lie within a
  thousandth of its standard error.
- Laws of bending whose BIC is more than `NEAR` above the least are rough fits: these agree to `ROUGH`.
- Residuals are small differences of large numbers; those that the fit does not make least (by windows of time, by
  records, shares of misfit) agree to `RESIDUALS` times that tolerance, relative to the largest of them.
- Standard errors and intervals from random draws agree within `ERRORS` Monte Carlo errors of the difference of two
  runs.
- What says how a search went, not what it found, must be there with any value: `ANY_VALUE`.
- Text that is written for people may be worded anew: `WORDED` must be there, empty where the reference's is empty. Of
  lists of such text, `COUNTED`, the number must be the same; so must the number of warnings on stderr.
- All other text, such as units, names of models and methods, is the same; a number with a unit is read as both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

#: Relative tolerances of numbers, and of standard errors and all else that is not a fitted value, by class of run.
#: "steps": an adaptive integration to 1e-6, whose steps other rounding moves; on another processor it differs by 6e-9.
#: What is not a fitted value comes from differences of predictions: on another processor it differs by 2e-9, with
#: ngspice in the loop by 1.1e-6.
VALUES = {"exact": 1e-9, "ngspice": 1e-7, "steps": 1e-7}
OTHERS = {"exact": 1e-8, "ngspice": 3e-6, "steps": 1e-7}
#: Most that a fitted value may move, in its standard errors.
STANDARD_ERRORS = 1e-3
#: Tolerances of single keys where that of the class asks too much, or has no meaning.
LOOSE = {"condition": 1e-3, "correlation": 1e-3, "ngspice": 1e-6, "largest_move_in_standard_errors": 1e-2}
#: A descent to a poor fit ends where little more is to be gained, which other rounding moves.
NEAR, ROUGH = 10.0, 1e-2
RESIDUALS, RESIDUAL_KEYS = 1e3, ("rms_own", "rms_joint", "rms_predicted", "share", "worst")
ERRORS, DRAWS = 3.0, 2000

ANY_VALUE = {
    *("evaluations", "starts", "starts_agreeing", "scattered", "agreeing", "spread", "relative_offset"),
    *("estimated_error", "estimated_wave_error", "error", "largest_difference"),
    *("steps", "autocorrelation_steps", "acceptance"),
}
WORDED = {
    *("held", "verdict", "against", "method_note", "not_predicted", "reason", "aim", "text", "what"),
    *("convention", "other_convention", "rest_states_found_by"),
}
COUNTED = {"warnings", "open", "undetermined", "omissions"}
#: What says by which program and call an answer was made, not what it is.
IGNORED = {"provenance"}
#: What tells the items of a list from one another.
LABELS = ("model", "law", "terms", "source", "quantity", "test", "stretch")

#: Standard error of the 2.5 % quantile of one normal draw, in standard deviations; n draws have it over sqrt(n).
_QUANTILE = math.sqrt(0.025 * 0.975) / (math.exp(-(1.959964**2) / 2) / math.sqrt(2 * math.pi))


@dataclass(frozen=True)
class Rule:
    """How closely numbers are compared: ``tolerance`` relative to ``size``, or to the number itself without one."""

    klass: str
    tolerance: float
    draws: float = math.inf
    size: float | None = None

    def allowed(self, reference: float) -> float:
        return self.tolerance * (abs(reference) if self.size is None else self.size)


def differences(reference: dict[str, Any], got: dict[str, Any], klass: str) -> list[str]:
    """Where what is kept of a run differs from its reference, a line each; empty where it does not."""
    rule = Rule(klass, OTHERS[klass])
    found = list(_values("", {k: v for k, v in reference.items() if k != "outputs"}, got, rule))
    for name, expected in reference["outputs"].items():
        drawn = replace(rule, draws=_draws(reference))
        found += _values(name, expected, got["outputs"].get(name), drawn)
    return found


def _values(path: str, reference: Any, got: Any, rule: Rule) -> Iterator[str]:
    key = path.rsplit("/", 1)[-1]
    if key in IGNORED or key in ANY_VALUE:
        return
    if key in WORDED and isinstance(reference, str):
        if not (isinstance(got, str) and bool(got) == bool(reference)):
            yield f"{path}: reference {reference!r}, got {got!r}"
    elif key in COUNTED and isinstance(reference, list):
        if not (isinstance(got, list) and len(got) == len(reference)):
            yield f"{path}: reference has {len(reference)}: {reference}, got {got}"
    elif key in LOOSE and rule.tolerance < LOOSE[key]:
        yield from _values(path, reference, got, replace(rule, tolerance=LOOSE[key]))
    elif isinstance(reference, dict):
        if isinstance(got, dict):
            yield from _dict(path, key, reference, got, rule)
        else:
            yield f"{path}: reference is a table of {', '.join(reference)}, got {got!r}"
    elif isinstance(reference, list):
        if isinstance(got, list):
            yield from _list(path, key, reference, got, rule)
        else:
            yield f"{path}: reference is a list of {len(reference)}, got {got!r}"
    elif _is_number(reference) and _is_number(got):
        yield from _number(path, reference, got, rule.allowed(reference))
    else:
        yield from _text(path, reference, got, rule)


def _dict(path: str, key: str, reference: dict[str, Any], got: dict[str, Any], rule: Rule) -> Iterator[str]:
    if "values" in reference and "largest" in reference:  # a column
        size = None if key.startswith("frequency") else reference["largest"]  # those are even in logarithm
        rule = replace(rule, tolerance=VALUES[rule.klass], size=size)
    elif key == "correlations":
        rule = replace(rule, size=1.0)
    for name, expected in reference.items():
        below = f"{path}/{name}" if path else name
        if name not in got:
            yield f"{below}: is missing; reference {expected!r}"
        elif "value" in reference and "unit" in reference:
            yield from _of_quantity(below, name, reference, got, rule)
        elif name in RESIDUAL_KEYS and _is_number(expected):
            yield from _values(below, expected, got[name], replace(rule, tolerance=RESIDUALS * rule.tolerance))
        else:
            yield from _values(below, expected, got[name], rule)


def _of_quantity(path: str, name: str, reference: dict[str, Any], got: dict[str, Any], rule: Rule) -> Iterator[str]:
    """An entry of a quantity: its value, standard errors and intervals each have a tolerance of their own."""
    expected, answer, error = reference[name], got[name], reference.get("stderr")
    derived = "/derived/" in path  # whose standard errors are a bootstrap's where those of the parameters are
    # an autoregression's are no narrower than the bootstrap's, so that they may be drawn, too
    blocks = name.endswith(("_bootstrap", "_autoregression"))
    draws = DRAWS if blocks else rule.draws
    if name == "value" and _is_number(answer):
        allowed = VALUES[rule.klass] * max(abs(expected), error or 0.0)
        if rule.klass == "ngspice" and error:
            allowed = min(allowed, STANDARD_ERRORS * error)
        yield from _number(path, expected, answer, allowed, error)
    elif expected is not None and (blocks or name.endswith("_mcmc") or (derived and rule.draws < math.inf)):
        spread = reference.get("stderr_bootstrap") or error
        single = _QUANTILE if name.startswith("ci95") else math.sqrt(0.5)
        drawn = replace(rule, tolerance=ERRORS * math.sqrt(2 / draws) * single, size=spread)
        yield from _values(path, expected, answer, drawn)
    else:
        yield from _values(path, expected, answer, rule)


def _list(path: str, key: str, reference: list[Any], got: list[Any], rule: Rule) -> Iterator[str]:
    if key == "covariance":
        yield from _covariance(path, reference, got, rule)
        return
    flat = list(_flat(reference))
    if flat and rule.size is None and all(_is_number(n) or n is None for n in flat):  # an array
        rule = replace(rule, size=max((abs(n) for n in flat if n is not None), default=None))
    keys = _labels(reference)
    if keys:
        by_label = {tuple(str(item.get(k)) for k in keys): item for item in got if isinstance(item, dict)}
        for expected in reference:
            label = tuple(str(expected[k]) for k in keys)
            below = f"{path}[{', '.join(label)}]"
            if label in by_label:
                rough = key == "laws" and expected["bic"] > NEAR
                yield from _values(below, expected, by_label[label], replace(rule, tolerance=ROUGH) if rough else rule)
            else:
                yield f"{below}: is missing"
        return
    if len(reference) != len(got) and not (key == "candidates" and not reference):
        yield f"{path}: reference has {len(reference)} items, got {len(got)}"
        return
    if "/residual_windows/" in path and all(isinstance(item, dict) for item in reference):
        largest = max(item["rms"] for item in reference)
        for k, (expected, answer) in enumerate(zip(reference, got, strict=True)):
            bounds = {name: value for name, value in expected.items() if name != "rms"}
            yield from _values(f"{path}[{k}]", bounds, answer, rule)
            residual = replace(rule, tolerance=RESIDUALS * rule.tolerance, size=largest)
            yield from _values(f"{path}[{k}]/rms", expected["rms"], answer.get("rms"), residual)
        return
    for k, (expected, answer) in enumerate(zip(reference, got, strict=bool(reference))):
        yield from _values(f"{path}[{k}]", expected, answer, rule)


def _covariance(path: str, reference: list[list[float]], got: list[list[float]], rule: Rule) -> Iterator[str]:
    """A covariance by its standard errors; one from random draws within their Monte Carlo error."""
    if [len(row) for row in reference] != [len(row) for row in got]:
        yield f"{path}: reference has {len(reference)} rows, got {len(got)}"
        return
    tolerance = max(rule.tolerance, ERRORS * math.sqrt(2 / rule.draws) * math.sqrt(2))
    errors = [math.sqrt(row[k]) for k, row in enumerate(reference)]
    for i, row in enumerate(reference):
        for j, expected in enumerate(row):
            yield from _number(f"{path}[{i}][{j}]", expected, got[i][j], tolerance * errors[i] * errors[j])


def _text(path: str, reference: Any, got: Any, rule: Rule) -> Iterator[str]:
    if isinstance(reference, str) and isinstance(got, str) and reference != got:
        (before, _, unit), (after, _, other) = reference.partition(" "), got.partition(" ")
        if unit and unit == other:
            try:
                expected, answer = float(before), float(after)
            except ValueError:
                pass
            else:
                yield from _number(path, expected, answer, VALUES[rule.klass] * abs(expected))
                return
    if reference != got or isinstance(reference, bool) != isinstance(got, bool):
        yield f"{path}: reference {reference!r}, got {got!r}"


def _number(
    path: str, reference: float, got: float, allowed: float, standard_error: float | None = None
) -> Iterator[str]:
    difference = abs(got - reference)
    if not difference <= allowed:
        relative = difference / abs(reference) if reference else math.inf
        times = difference / allowed if allowed else math.inf
        errors = f" ({difference / standard_error:.1e} standard errors)" if standard_error else ""
        yield (
            f"{path}: reference {reference!r}, got {got!r}, relative difference {relative:.2e}{errors}, "
            f"{times:.3g} times what is allowed"
        )


def _labels(items: list[Any]) -> list[str]:
    """The keys whose values tell the ``items``, dicts, from one another; none where nothing does."""
    if not (items and all(isinstance(item, dict) for item in items)):
        return []
    keys = [k for k in LABELS if all(k in item for item in items)]
    return keys if len({tuple(str(item[k]) for k in keys) for item in items}) == len(items) else []


def _draws(reference: dict[str, Any]) -> float:
    """From how many independent draws the intervals of a run are; infinitely many where none were drawn."""
    fit = reference["outputs"].get("fit.json") or {}
    intervals = fit.get("statistics", {}).get("intervals", {})
    chains = [c for c in (intervals, *intervals.values()) if isinstance(c, dict) and c.get("method") == "mcmc"]
    # the first five autocorrelation times are thrown away
    sizes = [c["walkers"] * (c["steps"] / c["autocorrelation_steps"] - 5) for c in chains]
    if any("stderr_bootstrap" in p for p in fit.get("parameters", {}).values()):
        sizes.append(DRAWS)
    return min(sizes, default=math.inf)


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, list):
        for item in value:
            yield from _flat(item)
    else:
        yield value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
