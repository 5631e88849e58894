"""One step over time in every format that is read, as text; the names begin with those of the formats."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

T: Array = np.round(np.arange(0.0, 12.0, 0.05), 6)
U: Array = np.where(T >= 2.0, 1.5, 0.0)
I: Array = np.where(T >= 2.0, 0.002 + 0.02 * np.exp(-(T - 2.0) / 1.3), 0.0)  # noqa: E741 - the current's usual name
Y: Array = np.where(T >= 2.0, 1e-3 * (1 - np.exp(-(T - 2.0) / 0.8)), 0.0)

_MODE = "mode\tox/red\terror\tcontrol changes\tNs changes\tcounter inc.\tNs\t"


def csv(delimiter: str = ",", comma: bool = False, end: str = "\n") -> str:
    rows = [delimiter.join(f"{x:.12g}" for x in row) for row in zip(T * 1e3, U * 1e3, I * 1e6, Y * 1e6, strict=True)]
    text = "\n".join(rows)
    if comma:
        text = text.replace(".", ",")
    header = delimiter.join(["time_ms", "voltage [mV]", "current_uA", "laser displacement (\u00b5m)"])
    return (header + "\n" + text + "\n").replace("\n", end)


def ec_lab(comma: bool = False, preamble: bool = True, voltage: str = "Ewe/V", current: str = "<I>/mA") -> str:
    head = f"{_MODE}time/s\tcontrol/V\t{voltage}\t{current}\tcycle number\tdq/mA.h\t(Q-Qo)/mA.h\tI Range\tP/W\t"
    rows = [
        f"2\t1\t0\t0\t0\t0\t{int(u > 0)}\t{t:.15E}\t{u + 0.01:.7E}\t{u:.9E}\t{1e3 * i:.12E}\t0\t1.0E-3\t2.0E-3\t8\t0\t"
        for t, u, i in zip(T, U, I, strict=True)
    ]
    text = "\n".join([head, *rows]) + "\n"
    if comma:
        text = text.replace(".", ",")
    if not preamble:
        return text
    before = ["EC-Lab ASCII FILE", "Nb header lines : 9", "", "Chronoamperometry / Chronocoulometry", ""]
    before += ["Ewe ctrl range : min = -10.00 V, max = 10.00 V", "Electrode surface area : 0.001 cm\u00b2", ""]
    return "\n".join([*before, text])


def gamry(overloaded: range = range(0), comma: bool = False) -> str:
    def over(k: int) -> str:
        return "......v...a" if k in overloaded else "..........."

    def rows(a: int, b: int) -> list[str]:
        return [f"\t{k}\t{T[k]:.9g}\t{U[k]:.9g}\t{I[k]:.12g}\t0\t{U[k]:g}\t0\t9\t{over(k)}\t20" for k in range(a, b)]

    names = "\tPt\tT\tVf\tIm\tVu\tSig\tAch\tIERange\tOver\tTemp"
    units = "\t#\ts\tV vs. Ref.\tA\tV\tV\tV\t#\tbits\tdeg C"
    head = ["EXPLAIN", "TAG\tCHRONOAMP", "TITLE\tLABEL\tChronoamperometry\tTest &Identifier", "OCVCURVE\tTABLE\t1"]
    head += ["\tPt\tT\tVf", "\t#\ts\tV vs. Ref.", "\t0\t0.25\t-0.34", "EOC\tQUANT\t-0.29\tOpen Circuit (V)"]
    body = [f"CURVE\tTABLE\t{len(T)}", names, units, *rows(0, len(T)), "EXPERIMENTABORTED\tTOGGLE\tT\tAborted", ""]
    text = "\n".join([*head, *body])
    return re.sub(r"(\d)\.(\d)", r"\1,\2", text) if comma else text


FORMATS: dict[str, Callable[[], str]] = {
    "CSV": csv,
    "CSV, semicolon, decimal comma": lambda: csv(";", comma=True),
    "CSV, tab": lambda: csv("\t"),
    "CSV, Windows line ends": lambda: csv(end="\r\n"),
    "CSV, mark of UTF-8": lambda: "\ufeff" + csv(),
    "EC-Lab": ec_lab,
    "EC-Lab, decimal comma": lambda: ec_lab(comma=True),
    "EC-Lab, no preamble": lambda: ec_lab(preamble=False),
    "EC-Lab, <Ewe> and I": lambda: ec_lab(voltage="<Ewe>/V", current="I/mA"),
    "EC-Lab, both electrodes": lambda: ec_lab(voltage="Ewe-Ece/V"),
    "Gamry": gamry,
    "Gamry, decimal comma": lambda: gamry(comma=True),
}
