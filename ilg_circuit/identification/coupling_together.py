"""Fits one law of bending to several files at once, each with a gain of its own, and predicts each from the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..errors import IlgError
from ..fit.criteria import effective_samples, structured
from ..fit.minimise import descended
from .coupling_trials import Strand, Trial, basis_of, begun, coordinates_of, reason_against, shape_at
from .motion_laws import MotionLaw

#: Ends of a descent, as of a single file's.
_TOLERANCE, _EVALUATIONS = 1e-7, 80
_FAR = 8.0
#: How much the scatter of gains must be above chance, in units of BIC.
_EVIDENCE = 10.0


@dataclass(frozen=True, eq=False)
class Together:
    """The joint fit: coordinates ``x`` (p + k - 1,), constants and the gains relative to the one of ``pivot``.

    ``scales`` (files,) [m/V] are the gains of each file, times the axis.
    """

    law: MotionLaw
    strands: tuple[Strand, ...]
    trials: tuple[Trial, ...]
    pivot: int
    x: Array

    @classmethod
    def of(cls, law: MotionLaw, strands: Sequence[Strand], trials: Sequence[Trial]) -> Together | None:
        """Return the best fit from each file's own; None where there is none."""
        best: Together | None = None
        for trial in trials:
            pivot = int(np.argmax(np.abs(trial.gains)))
            ratios = np.delete(trial.gains / trial.gains[pivot], pivot)
            begin = np.append(coordinates_of(law, trial.shape), ratios)
            found = cls(law, tuple(strands), tuple(trials), pivot, begin)._descended()
            if found is not None and (best is None or found._squares() < best._squares() * (1 - 1e-6)):
                best = found
        return best

    @property
    def unknowns(self) -> int:
        """Number of parameters: constants, ratios of gains, and a gain of each file."""
        return len(self.x) + len(self.trials)

    @property
    def sizes(self) -> Array:
        """The spans [m] of the files (files,)."""
        return np.array([trial.size for trial in self.trials])

    @property
    def residuals(self) -> list[Array]:
        """Residuals [m] of each file."""
        return [self._file(k, self.x)[0] for k in range(len(self.trials))]

    @property
    def scales(self) -> Array:
        return np.array([self._file(k, self.x)[2] for k in range(len(self.trials))])

    @property
    def against(self) -> str:
        """The reason why the law is not chosen, as of a single file's trial."""
        scale = float(np.median(np.abs(self.scales)))
        gains = self._direction(self.x) * scale * (np.sign(self.scales.sum()) or 1.0)
        p = len(self.x) - len(gains) + 1
        errors = self._errors()
        ratios = np.delete(self._direction(self.x), self.pivot)
        relative = np.concatenate([errors[:p], errors[p:] / np.abs(ratios)])
        return reason_against(self.law, shape_at(self.law, self.x[:p]), gains, relative)

    def prediction(self) -> float:
        """Return the error in predicting each file from all others, with its own gain: rms over span, rms of files."""
        errors = []
        for k in range(len(self.trials)):
            others = [j for j in range(len(self.trials)) if j != k]
            part = replace(
                self, strands=tuple(self.strands[j] for j in others), trials=tuple(self.trials[j] for j in others)
            )._descended()
            if part is None:
                return np.inf
            residuals = self._file(k, part.x)[0]
            errors.append(float(np.sqrt(np.mean(residuals**2))) / self.trials[k].size)
        return float(np.sqrt(np.mean(np.square(errors))))

    def gains_differ(self) -> bool:
        """Return whether the files' gains differ beyond their errors."""
        logs = np.log(np.abs(self.scales))
        errors = np.array([self._file(k, self.x)[3] for k in range(len(self.trials))])
        weights = 1 / errors**2
        middle = float(weights @ logs / weights.sum())
        samples = sum(len(r) for r in self.residuals)
        return bool(weights @ (logs - middle) ** 2 > (len(logs) - 1) * np.log(samples) + _EVIDENCE)

    def begins(self) -> tuple[MotionLaw, list[tuple[Array, float]]]:
        """Return the law with the signs of its gains, and each file's values and sign of the axis."""
        p = len(self.x) - len(self._direction(self.x)) + 1
        shape, found = shape_at(self.law, self.x[:p]), []
        for strand, trial, scale in zip(self.strands, self.trials, self.scales.tolist(), strict=True):
            own = replace(trial, shape=shape, gains=scale * self._direction(self.x))
            found.append(begun(own, strand))
        return found[0][0], [(values, sign) for _, values, sign in found]

    def _direction(self, x: Array) -> Array:
        """Return the gains relative to the pivot's (k,)."""
        p = len(self.trials[0].shape)
        return np.insert(x[p:], self.pivot, 1.0)

    def _file(self, k: int, x: Array) -> tuple[Array, Array, float, float]:
        """Return residuals [m] of a file, their derivatives (samples, n), its gain and the error of its logarithm."""
        strand, trial = self.strands[k], self.trials[k]
        count, p = len(trial.t), len(trial.shape)
        basis, slopes = basis_of(self.law, strand.waves(self.law), x[:p], count)
        direction = self._direction(x)
        curve = direction @ basis
        y, beside = strand.values[:count] - trial.held * trial.t, strand.beside[:count, : trial.terms]
        size = float(np.linalg.norm(curve)) or 1.0
        q, r = np.linalg.qr(np.column_stack([curve / size, beside]))
        amounts = np.linalg.lstsq(r, q.T @ y, rcond=1e-12)[0]
        residuals = y - q @ (r @ amounts)
        scale = float(amounts[0]) / size
        moved = np.vstack([np.einsum("pkn,k->pn", slopes, direction), np.delete(basis, self.pivot, axis=0)]) * scale
        derivatives = -(moved - (moved @ q) @ q.T).T
        independent = effective_samples(residuals) if structured(residuals) else float(count)
        # of the gain, beside rest and drift
        left = curve - strand.beside[:count, : trial.terms] @ np.linalg.lstsq(beside, curve, rcond=None)[0]
        error = float(np.sqrt(residuals @ residuals / independent) / max(abs(scale) * np.linalg.norm(left), 1e-300))
        return residuals, derivatives, scale, error

    def _weighted(self, x: Array) -> tuple[Array, Array]:
        files = [self._file(k, x) for k in range(len(self.trials))]
        weights = [1 / max(trial.rmse, 1e-6 * trial.size) for trial in self.trials]
        residuals = np.concatenate([w * f[0] for w, f in zip(weights, files, strict=True)])
        return residuals, np.concatenate([w * f[1] for w, f in zip(weights, files, strict=True)])

    def _squares(self) -> float:
        residuals, _ = self._weighted(self.x)
        return float(residuals @ residuals)

    def _descended(self) -> Together | None:
        last: tuple[Array, tuple[Array, Array]] | None = None

        def at(x: Array) -> tuple[Array, Array]:
            nonlocal last
            if last is None or not np.array_equal(last[0], x):
                if np.abs(x - self.x).max() > _FAR * max(1.0, float(np.abs(self.x).max())):
                    raise ValueError("the fit ran away")
                last = x.copy(), self._weighted(x)
            return last[1]

        try:
            x = descended(
                lambda x: at(x)[0],
                lambda x: at(x)[1],
                self.x,
                ftol=_TOLERANCE,
                xtol=_TOLERANCE**0.8,
                most=_EVALUATIONS,
            )
        except (IlgError, ValueError, np.linalg.LinAlgError):
            return None
        return replace(self, x=x)

    def _errors(self) -> Array:
        """Return standard errors (n,) of the coordinates, wider where residuals are autocorrelated."""
        residuals, derivatives = self._weighted(self.x)
        counts = [len(trial.t) for trial in self.trials]
        parts = np.split(residuals, np.cumsum(counts)[:-1])
        independent = sum(effective_samples(r) if structured(r) else len(r) for r in parts)
        variance = float(residuals @ residuals) / independent
        size = np.linalg.norm(derivatives, axis=0)
        size[size == 0] = 1.0
        try:
            inverse = np.linalg.inv(np.linalg.qr(derivatives / size, mode="r")) / size[:, None]
        except np.linalg.LinAlgError:
            return np.full(len(self.x), np.inf)
        return np.asarray(np.sqrt(variance) * np.linalg.norm(inverse, axis=1))

    def relative_gains(self) -> tuple[float, ...]:
        """Return each file's gain relative to the geometric mean."""
        logs = np.log(np.abs(self.scales))
        return tuple(np.exp(logs - logs.mean()).tolist())
