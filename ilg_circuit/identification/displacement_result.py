"""The fit of one record's displacement."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays import Array
from ..findings import Finding
from ..fit.result import FitResult
from ..measurements.rest import Rest
from ..strip.actuator import CouplingLaw
from .motion import DisplacementData, Motion


@dataclass(frozen=True)
class DisplacementFit:
    """Fit of d(s) to one record.

    ``data`` include the window; ``fitted`` [m] (samples,) is the model at all samples; ``per_volt`` [m/V] the static
    displacement. The fit's residuals cover rest and window. ``at_rest`` is the straight line through the readings at
    rest; ``wanted`` [m/s] is the unconstrained drift, if the rest does not allow it. ``bic_gain`` is the BIC of the
    static beam minus the BIC of the dynamic beam, None if only one of them could be fitted.
    """

    data: DisplacementData
    motion: Motion
    fit: FitResult
    fitted: Array
    per_volt: float
    at_rest: Rest
    findings: tuple[Finding, ...]
    wanted: float | None = None
    bic_gain: float | None = None

    @property
    def coupling(self) -> CouplingLaw:
        return self.motion.law.coupling(self.fit.values, self.motion.beam)

    @property
    def rest(self) -> float:
        """Position at rest [m] at the onset by the readings before it, by one at the onset, or else the fit's."""
        if not self.at_rest.count and self.data.since(self.data.channel)[0] > 0:
            return self.level
        return self.at_rest.middle if self.drift is None else self.at_rest.position(self.drift)

    @property
    def level(self) -> float:
        """Initial position [m] of the model: the fit's constant."""
        return self.data.reference + float(self.fit.nuisance[0])

    @property
    def drift(self) -> float | None:
        """Slow linear drift [m/s] in addition to d(s), None if the rest does not support one."""
        if self.data.drift:
            return float(self.fit.nuisance[1])
        return self.data.held if self.at_rest.bounds_drift else None
