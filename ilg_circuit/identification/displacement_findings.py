"""Findings on a fit of d(s): misfit by windows of time, window, drift, beam, undetermined parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..findings import Finding
from ..fit.criteria import structured
from ..fit.identifiability import DETERMINED
from ..fit.multistart import StartSummary
from ..measurements.smoothing import noise_level

if TYPE_CHECKING:
    from .displacement import DisplacementFit

#: Least misfit that is reported, as a fraction of the span.
_SAID = 0.02
#: Residuals below this fraction of the span are ignored, even if they have structure.
_NEGLIGIBLE = 1e-4
_OVER_NOISE = 1.5
#: A drift is reported from this number of its standard errors on.
_SEEN = 3.0


def displacement_findings(found: DisplacementFit, described: bool) -> list[Finding]:
    """Return the findings on a fit; ``described`` is True if d(s) describes the displacement."""
    data, fit, channel = found.data, found.fit, found.data.channel
    said: list[Finding] = []
    if data.window < channel.time[-1]:
        away = float(np.abs(channel.values - found.fitted)[channel.time > data.window].max())
        said.append(Finding("displacement-shortened", values={"window": data.window, "away": away}))
    elif not described:
        said.append(Finding("displacement-not-described"))
    if data.sign < 0:
        said.append(Finding("displacement-axis-reversed"))
    said += _drift_findings(found)
    if found.motion.beam == "dynamic":
        said.append(Finding("displacement-shows-inertia", values={"bic_gain": found.bic_gain}))
    uneasy = max(_OVER_NOISE * noise_level(channel.values), _NEGLIGIBLE * float(np.ptp(channel.values)))
    if structured(fit.residuals) and fit.rmse > uneasy:
        said.append(Finding("displacement-autocorrelated"))
    errors = zip(fit.labels, fit.values, fit.errors, strict=True)
    loose = [label for label, value, error in errors if error > DETERMINED * value]
    if loose:
        reason = f"standard error over {DETERMINED:.0%}: {', '.join(loose)}"
        said.append(Finding("not-determined", values={"reason": reason}))
    return said + start_findings(fit.starts, "displacement")


def _drift_findings(found: DisplacementFit) -> list[Finding]:
    data, rest = found.data, found.at_rest
    if data.drift:
        rate, error = float(found.fit.nuisance[1]), float(found.fit.nuisance_errors[1])
        seen = abs(rate) > _SEEN * error and abs(rate) * data.window > _NEGLIGIBLE * data.size
        return [Finding("displacement-drifts", values={"rate": rate, "stderr": error})] if seen else []
    if found.wanted is None or abs(found.wanted - data.held) * data.window <= _SAID * data.size:
        return []
    values = {"wanted": found.wanted, "held": data.held, "slope": rest.slope, "half": rest.half}
    return [Finding("displacement-drift-held", values=values)]


def start_findings(starts: StartSummary, quantity: str = "") -> list[Finding]:
    """Return the finding on a minimum that was reached from one start only."""
    if starts.confirmed:
        return []
    return [Finding("start-not-confirmed", quantity, {"starts": starts.starts})]
