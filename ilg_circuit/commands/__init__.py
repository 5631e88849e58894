"""The commands of `ilg-circuit`, one a module, each of which imports what it needs when it is called.

In: options. Out: files, text and an exit code. May import: every room.
"""

from __future__ import annotations

from . import (
    arm,
    cpg,
    demo,
    design,
    doctor,
    identify,
    impedance,
    netlist,
    ogden,
    reproduce,
    sense,
    show,
    simulate,
    sweep,
)

COMMANDS = (
    show.show,
    simulate.simulate,
    netlist.netlist,
    identify.identify,
    impedance.impedance,
    sense.sense,
    ogden.ogden,
    cpg.cpg,
    arm.arm,
    sweep.sweep,
    design.design,
    reproduce.reproduce,
    demo.demo,
    doctor.doctor,
)

__all__ = ["COMMANDS"]
