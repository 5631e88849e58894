"""The result of a characterisation: the material fitted to load tests, and its predictions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..findings import Finding, sentences
from ..fit.estimate import Estimate, Estimated
from ..measurements.branches import RELOADING, UNLOADING, Leg, area_shares
from ..measurements.load_test import LoadTest
from ..result import Column, Curve, Result
from .estimates import correlations, derived, parameters
from .fit import HyperelasticFit
from .material import CONVENTION, OTHER_CONVENTION, Ogden


@dataclass(frozen=True)
class Prediction:
    """Nominal and Cauchy stress [Pa] of one mode at one stretch.

    ``error`` is the nominal stress's standard error, NaN if the data do not determine it; ``measured`` is True if a
    test of this mode covers the stretch.
    """

    mode: str
    stretch: float
    nominal: float
    cauchy: float
    error: float
    measured: bool

    def to_dict(self) -> dict[str, Any]:
        return {
            "test": self.mode,
            "stretch": self.stretch,
            "nominal": self.nominal,
            "stderr": self.error if math.isfinite(self.error) else None,
            "cauchy": self.cauchy,
            "unit": "Pa",
            "measured": self.measured,
        }


@dataclass(frozen=True)
class Instability:
    """A range of stretches, ``low`` to ``high`` within the data's range, where a mode is unstable.

    ``kind``: "slope" (the nominal stress does not rise with the stretch) or "drucker" (nor does the Kirchhoff stress
    with the logarithmic strain).
    """

    mode: str
    kind: str
    low: float
    high: float

    def to_dict(self) -> dict[str, Any]:
        return {"test": self.mode, "kind": self.kind, "stretch": [self.low, self.high]}


@dataclass(frozen=True, repr=False, eq=False)
class Characterisation(Estimated, Result):
    """The hyperelastic material fitted to load tests, as `ilg_circuit.ogden` returns it.

    Attributes
    ----------
    material : Material
        The fitted material: ``mu`` [Pa] and ``alpha`` of each term.
    success : bool
        False if a finding says that the fit is not to be used.
    fit : HyperelasticFit
        The fit that was chosen.
    candidates : tuple of HyperelasticFit
        The fits from which it was chosen.
    predictions : tuple of Prediction
        Stresses at the stretches that were asked for.
    instabilities : tuple of Instability
        Stretches at which the material loses stability.
    small_strain_modulus : tuple of float or None
        E [Pa], the tangent at stretch 1, by the readings at small strains alone, and its standard error.
    warnings : tuple of str
        Findings as sentences.
    seed : int
        Seed of the random starts.
    """

    presenter: ClassVar[str] = "ogden"

    fit: HyperelasticFit
    candidates: tuple[HyperelasticFit, ...]
    predictions: tuple[Prediction, ...]
    instabilities: tuple[Instability, ...]
    small_strain_modulus: tuple[float, float] | None
    findings: tuple[Finding, ...]
    seed: int = 0

    @property
    def material(self) -> Ogden:
        """The fitted material."""
        return self.fit.material

    @property
    def tests(self) -> tuple[LoadTest, ...]:
        """The load tests that were fitted."""
        return self.fit.tests

    @property
    def success(self) -> bool:
        """True if the material describes the measurements; otherwise no strip is written with it."""
        return self.fit.success

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as sentences."""
        return sentences(self.findings)

    def estimate_tables(self) -> dict[str, dict[str, Estimate]]:
        """Return the parameters, and derived quantities such as ``youngs_modulus``."""
        return {"parameter": parameters(self.fit), "derived": derived(self.fit)}

    def curves(self) -> Iterator[Curve]:
        """Yield the nominal stress of every test with the fit."""
        for t, residuals in zip(self.fit.tests, self.fit.residuals, strict=True):
            over = Column("stretch", t.stretch, "")
            yield Curve(f"stress_{t.mode}", "Pa", t.source, over, t.stress, t.stress - residuals)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data in SI units; undetermined values are null."""
        fit, small = self.fit, self.small_strain_modulus
        return {
            "success": self.success,
            "model": fit.model,
            "terms": fit.terms,
            "convention": CONVENTION,
            "other_convention": OTHER_CONVENTION,
            "parameters": _plain(parameters(fit)),
            "derived": _plain(derived(fit)),
            "statistics": _statistics(fit),
            "correlations": correlations(fit),
            "candidates": [
                {
                    "model": f.model,
                    "terms": f.terms,
                    "rmse": f.rmse,
                    "aic": f.aic,
                    "bic": f.bic,
                    "undetermined": list(sentences(f.undetermined)),
                }
                for f in self.candidates
            ],
            "stability": {
                "constrained": fit.constrained,
                "mu_alpha_positive": fit.material.stable_by_sign,
                "unstable": [i.to_dict() for i in self.instabilities],
            },
            "small_strain_modulus": Estimate(small[0], "Pa", small[1]).to_dict() if small else None,
            "predictions": [p.to_dict() for p in self.predictions],
            "warnings": list(self.warnings),
            "findings": [f.to_dict() for f in self.findings],
        }


def _branch(leg: Leg) -> dict[str, Any]:
    ends = {"first_stretch": float(leg.stretch[0]), "last_stretch": float(leg.stretch[-1])}
    return {"branch": leg.kind, "n": len(leg.stretch), **ends}


def _plain(estimates: Mapping[str, Estimate]) -> dict[str, Any]:
    return {name: e.to_dict() for name, e in estimates.items()}


def _statistics(fit: HyperelasticFit) -> dict[str, Any]:
    return {
        "rmse": fit.rmse,
        "rmse_unit": "Pa",
        "aic": fit.aic,
        "bic": fit.bic,
        "n": fit.samples,
        "weighting": fit.weighting,
        "starts": fit.result.starts.starts,
        "starts_agreeing": fit.result.starts.agreeing,
        "evaluations": fit.result.evaluations,
        "tests": {
            t.mode: {
                "source": t.source,
                "rmse": float(np.sqrt(np.mean(r**2))),
                "n": len(r),
                "stretch": list(t.extent),
                "misfit": m.to_dict(),
                "branch": t.branch,
                "branches": [_branch(leg) for leg in t.legs],
                "hysteresis": area_shares(t.legs).get(UNLOADING),
                "softening": area_shares(t.legs).get(RELOADING),
            }
            for t, r, m in zip(fit.tests, fit.residuals, fit.misfits, strict=True)
        },
    }
