"""Hands a strip and a controller to other programs: python-control, a microcontroller."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..errors import InputError
from ..solve.state_space import state_space
from ..strip.actuator import Actuator
from .laws import Law
from .sampled import SampledLaw

#: Outputs of a strip by the names that control engineers give them.
OUTPUTS = {"y": "displacement", "i": "current", "F": "force"}


def to_control(actuator: Actuator, beam: str | None = None, load: Load | None = None, tip: str = "free") -> Any:
    """Return the linearised strip as ``control.ss``: input u [V]; outputs y [m], i [A], F [N]."""
    import control

    net = strip_netlist(actuator, beam=beam, load=load, tip=tip).linearised()
    system = state_space([net])
    outputs = {short: name for short, name in OUTPUTS.items() if name in system.output_names}
    rows = [system.output_names.index(name) for name in outputs.values()]
    a, b = system.a[0], system.b[0, :, :1]
    return control.ss(
        a, b, system.c[0][rows], system.d[0][rows][:, :1], inputs=["u"], outputs=list(outputs), name=actuator.name
    )


def c_text(law: Law, period: float, limit: float) -> str:
    """Return the sampled law as C: ``double ilg_step(double reference, double measured)`` in metres and volts.

    Raises InputError for a period that is not more than zero.
    """
    if not (np.isfinite(period) and period > 0):
        raise InputError(f"a sampled controller needs a period of more than zero, not {period:g} s")
    sampled = SampledLaw(law, period, limit)
    n = len(law.out)
    clamp = (
        f"    if (next[0] > {limit!r}) next[0] = {limit!r};\n    if (next[0] < {-limit!r}) next[0] = {-limit!r};\n"
        if law.clamps
        else ""
    )
    gains = ", ".join(f"{name} {value:.6g}" for name, value in law.gains.items())
    return f"""/* {law.kind} controller of an ionic-liquid-gel strip's position: {gains} [SI]
 * Call ilg_step every {period!r} s with the reference and the measured displacement [m]; it returns the voltage [V],
 * which is limited to {limit!r} V either way. ilg_reset begins anew. */
#define ILG_STATES {n}

static const double ilg_a[ILG_STATES][ILG_STATES] = {_matrix(sampled.a)};
/* of reference, measured displacement, voltage */
static const double ilg_b[ILG_STATES][3] = {_matrix(sampled.b)};
static const double ilg_c[ILG_STATES] = {_row(law.out)};
static double ilg_x[ILG_STATES];

void ilg_reset(void)
{{
    for (int k = 0; k < ILG_STATES; k++) ilg_x[k] = 0.0;
}}

double ilg_step(double reference, double measured)
{{
    double asked = {float(law.reference)!r} * reference + {float(law.measured)!r} * measured, next[ILG_STATES], voltage;
    for (int k = 0; k < ILG_STATES; k++) asked += ilg_c[k] * ilg_x[k];
    voltage = asked > {limit!r} ? {limit!r} : asked < {-limit!r} ? {-limit!r} : asked;
    for (int k = 0; k < ILG_STATES; k++) {{
        next[k] = ilg_b[k][0] * reference + ilg_b[k][1] * measured + ilg_b[k][2] * voltage;
        for (int j = 0; j < ILG_STATES; j++) next[k] += ilg_a[k][j] * ilg_x[j];
    }}
{clamp}    for (int k = 0; k < ILG_STATES; k++) ilg_x[k] = next[k];
    return voltage;
}}
"""


def _row(values: Array) -> str:
    return "{" + ", ".join(repr(float(value)) for value in values) + "}"


def _matrix(values: Array) -> str:
    return "{" + ", ".join(map(_row, values)) + "}"
