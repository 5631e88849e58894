"""One spectrum in every format that is read, as text; the names begin with those of the formats."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.strip.models import electrical_model

F: NDArray[np.float64] = np.geomspace(1e5, 1e-2, 36)  # as instruments sweep: downwards
Z: NDArray[np.complex128] = (
    electrical_model("rc2").port((400.0, 20.0, 0.01, 100.0, 0.02), 2.0).impedance(2j * np.pi * F, ideal=True)
)


def csv() -> str:
    rows = [f"{f!r},{z.real!r},{z.imag!r}" for f, z in zip(F.tolist(), Z.tolist(), strict=True)]
    return "\n".join(["frequency_Hz,re_ohm,im_ohm", *rows]) + "\n"


def ec_lab(comma: bool = False, preamble: bool = False) -> str:
    head = "freq/Hz\tRe(Z)/Ohm\t-Im(Z)/Ohm\t|Z|/Ohm\tPhase(Z)/deg\ttime/s\t"
    rows = [
        f"{f:.9E}\t{z.real:.9E}\t{-z.imag:.9E}\t{abs(z):.9E}\t{np.degrees(np.angle(z)):.7E}\t{k:.1f}\t"
        for k, (f, z) in enumerate(zip(F, Z, strict=True))
    ]
    text = "\n".join([head, *rows]) + "\n"
    if comma:
        text = text.replace(".", ",")
    before = (
        "EC-Lab ASCII FILE\nNb header lines : 6\n\nElectrode surface area : 1 cm\u00b2\nff\t10.000\n"
        if preamble
        else ""
    )
    return before + text


def bare() -> str:
    rows = [f"{f:.17e},{z.real:.17e},{z.imag:.17e}" for f, z in zip(F, Z, strict=True)]
    return "\n".join(rows) + "\n"


def gamry() -> str:
    rows = [
        f"\t{k}\t{k}\t{f:.9g}\t{z.real:.9g}\t{z.imag:.9g}\t1\t{abs(z):.9g}\t0\t1E-6\t0.1\t7"
        for k, (f, z) in enumerate(zip(F, Z, strict=True))
    ]
    return "\n".join(
        [
            "EXPLAIN",
            "TAG\tEISPOT",
            "OCVCURVE\tTABLE\t1",
            "\tPt\tT\tVf",
            "\t#\ts\tV vs. Ref.",
            "\t0\t0.25\t-0.34",
            "EOC\tQUANT\t-0.29\tOpen Circuit (V)",
            "ZCURVE\tTABLE",
            "\tPt\tTime\tFreq\tZreal\tZimag\tZsig\tZmod\tZphz\tIdc\tVdc\tIERange",
            "\t#\ts\tHz\tohm\tohm\tV\tohm\t\u00b0\tA\tV\t#",
            *rows,
            "EXPERIMENTABORTED\tTOGGLE\tT\tExperiment Aborted",
            "",
        ]
    )


def zplot(comments: bool = True) -> str:
    if comments:
        head = ["ZPLOT2 ASCII", "  Measured Data, ZPlot:       3.2c", "  Data Points:                36"]
        head += ["  Freq(Hz)\tAmpl\tBias\tTime(Sec)\tZ'(a)\tZ''(b)\tGD\tErr\tRange", "End Comments"]
        separator = "\t"
    else:
        head = ['"ZPlotW Data File: Version 3.2c"', '"Raw Data"', "0,3,0,1,300000,0.005", "36"]
        head += ["\"  Freq(Hz)    Ampl     Bias   Time(Sec)   Z'(a)    Z''(b)    GD   Err   Range\""]
        separator = ", "
    rows = [
        separator.join([f"{f:.9E}", "1.0E-02", "0.0E+00", "2.6", f"{z.real:.9E}", f"{z.imag:.9E}", "0", "0", "5"])
        for f, z in zip(F, Z, strict=True)
    ]
    return "\n".join([*head, *rows]) + "\n"


FORMATS: dict[str, Callable[[], str]] = {
    "CSV": csv,
    "CSV, EC-Lab's columns": ec_lab,
    "CSV, EC-Lab's columns, decimal comma": lambda: ec_lab(comma=True),
    "EC-Lab": lambda: ec_lab(preamble=True),
    "bare numbers": bare,
    "Gamry": gamry,
    "ZPlot": zplot,
    "ZPlot, old": lambda: zplot(comments=False),
}
