"""Each file of a joint fit beside itself: what its own fit leaves, the joint one, and that of all others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import IlgError
from ..fit.bootstrap import correlated
from ..fit.together import Together
from .datasets import Progress
from .joint_current import JointCurrent, levels_differ
from .joint_displacement import JointDisplacement

Array = NDArray[np.float64]
Numbers = NDArray[Any]

#: A joint fit that leaves so many times what the own fits leave does not hold for all records.
WORSE = 1.5
#: An own fit that leaves this part of a record describes nothing.
_HOPELESS = 0.15
_MEASURE = {"current": "peak", "impedance": "abs(Z)", "displacement": "span"}
#: Misfits below this part of a record's size are of no interest, whatever their ratio.
_NEGLIGIBLE = 1e-4


@dataclass(frozen=True)
class RecordFit:
    """One measured quantity of one file in a joint fit, and what three fits make of it.

    ``abscissa``: time since the onset [s], of an impedance frequency [Hz]. ``data``, ``fitted`` (jointly), ``alone``
    (by the own fit, of model ``own_model``) and ``foreseen`` (from the others; None, and ``unforeseen`` says why) in A,
    m, or complex ohm. ``own``, ``joint``, ``predicted`` are the rms of what these leave [``unit``], of an impedance
    over abs(Z); ``size`` is what they are small or large against: peak current, span of the displacement, one.
    """

    source: str
    quantity: str
    unit: str
    voltage: float
    abscissa: Array
    data: Numbers
    fitted: Numbers
    alone: Numbers
    foreseen: Numbers | None
    own_model: str
    own: float
    joint: float
    predicted: float | None
    size: float
    unforeseen: str = ""

    @property
    def residuals(self) -> Numbers:
        """data - joint fit."""
        return np.asarray(self.data - self.fitted)

    @property
    def unlike(self) -> bool:
        """Whether the joint fit leaves much more of it than its own."""
        return self.joint > max(WORSE * self.own, _NEGLIGIBLE * self.size)

    @property
    def hopeless(self) -> bool:
        """Whether its own fit leaves a large part of it."""
        return self.own > _HOPELESS * self.size

    def to_json(self) -> dict[str, Any]:
        """The comparison; waveforms are left to the picture."""
        return {
            "source": self.source,
            "quantity": self.quantity,
            "voltage": self.voltage,
            "own_model": self.own_model,
            "rms_own": self.own,
            "rms_joint": self.joint,
            "rms_predicted": self.predicted,
            "rms_unit": self.unit,
            "peak": self.size,
            "n": len(self.data),
        } | ({"not_predicted": self.unforeseen} if self.unforeseen else {})


#: The fit without each data set in turn, or why there is none.
LeftOut = Sequence[Together | str]


def leave_one_out(together: Together, progress: Progress, against: Sequence[str] = ()) -> LeftOut:
    """The fit of all others for each data set; none where something speaks ``against`` it, known beforehand."""
    if len(together.parts) < 2:
        return ["there is no other record"] * len(together.parts)
    found: list[Together | str] = []
    for k, why in enumerate(against or [""] * len(together.parts)):
        try:
            found.append(why or together.without(k, progress))
        except IlgError as error:
            found.append(f"the others by themselves: {error}")
    return found


def leave_one_port_out(found: JointCurrent, progress: Progress) -> LeftOut:
    """The same of a port, whose model may need several voltages."""
    against = []
    for k, left_out in enumerate(found.datasets):
        others = [d for j, d in enumerate(found.datasets) if j != k]
        enough = found.model.kind.linear or levels_differ(others)
        against.append("" if enough else f"without {left_out.source} the others are all at one voltage")
    return leave_one_out(found.together, progress, against)


def port_records(found: JointCurrent, without: LeftOut) -> list[RecordFit]:
    """Every current and impedance, each also predicted by the fit of all others."""
    together = found.together
    records = []
    for k, (d, own) in enumerate(zip(found.datasets, found.own, strict=True)):
        fitted = d.data - together.residuals(k)
        foreseen, why = _foreseen(together, k, without[k])
        records.append(
            RecordFit(
                source=d.source,
                quantity=d.quantity,
                unit=d.unit,
                voltage=d.voltage,
                abscissa=d.abscissa,
                data=d.shown(d.data),
                fitted=d.shown(fitted),
                alone=d.shown(own.fitted),
                foreseen=None if foreseen is None else d.shown(foreseen),
                own_model=own.model,
                own=own.rms,
                joint=together.parts[k].rms(fitted),
                predicted=None if foreseen is None else together.parts[k].rms(foreseen),
                size=d.size,
                unforeseen=why,
            )
        )
    return records


def displacement_records(moved: JointDisplacement, progress: Progress) -> list[RecordFit]:
    """Every displacement, over the stretch that its own fit describes."""
    without = leave_one_out(moved.together, progress) if moved.together is not None else []
    records = []
    for k, (source, own, voltage) in enumerate(zip(moved.sources, moved.own, moved.voltages, strict=True)):
        channel = own.channel.until(own.window)
        alone = own.fitted[: len(channel.time)]
        fitted, foreseen, why = alone, None, "no other record has a displacement"
        if moved.together is not None:
            fitted = channel.values - moved.together.residuals(k)
            ahead, why = _foreseen(moved.together, k, without[k])
            foreseen = None if ahead is None else ahead + own.rest
        records.append(
            RecordFit(
                source=source,
                quantity="displacement",
                unit="m",
                voltage=voltage,
                abscissa=channel.time,
                data=channel.values,
                fitted=fitted,
                alone=alone,
                foreseen=foreseen,
                own_model="d(s)",
                own=own.fit.rmse,
                joint=_rms(channel.values - fitted),
                predicted=None if foreseen is None else _rms(channel.values - foreseen),
                size=float(np.ptp(alone)),
                unforeseen=why,
            )
        )
    return records


def misfits(found: JointCurrent, records: Sequence[RecordFit], without: LeftOut) -> list[str]:
    """Warnings: records that one port does not hold for, structure that is left, what is not determined."""
    told = []
    hopeless = [f"{r.source} ({r.own / r.size:.0%} of its {_MEASURE[r.quantity]})" for r in records if r.hopeless]
    if hopeless:
        told.append(f"no port describes {', '.join(hopeless)} even by itself: look at the file, or leave it out")
    unlike = [r.source for r in records if r.unlike]
    if unlike:
        told.append(
            f"one port does not hold for all: own fits are {WORSE:g} times better or more for {', '.join(unlike)}"
        )
        told += _stranger(records, without)
    fit = found.together.fit
    if correlated(fit) and found.model.kind.name == "rc":
        told.append("one pole is not enough: the residuals have a structure; try --model rc2")
    if correlated(fit):
        told.append(
            "residuals of neighbouring samples are alike: standard errors that take them as independent are too small, "
            "those of a block bootstrap are given"
        )
    sure, why = found.determined
    if not sure:
        told.append(f"not determined by these data ({why})")
    return told


def _foreseen(together: Together, k: int, others: Together | str) -> tuple[Array | None, str]:
    """Data set ``k`` as the others predict it, with its own offset; or why they cannot."""
    if isinstance(others, str):
        return None, others
    try:
        return together.parts[k].fitted(others.mean), ""
    except IlgError as error:
        return None, f"what the others say cannot be solved: {error}"


def _stranger(records: Sequence[RecordFit], without: LeftOut) -> list[str]:
    """The one record without which a port holds for all others, if there is just one."""
    if len(records) < 3:
        return []
    strangers = []
    for k, others in enumerate(without):
        if isinstance(others, str):
            continue
        rest = [r for j, r in enumerate(records) if j != k]
        left = [replace(r, joint=_rms(others.residuals(j))) for j, r in enumerate(rest)]
        if not any(r.unlike for r in left):
            strangers.append(records[k].source)
    if len(strangers) != 1:
        return []
    return [f"without {strangers[0]} one port holds for all others: is it of another strip, or of another state of it?"]


def _rms(residuals: Array) -> float:
    return float(np.sqrt(np.mean(residuals**2)))
