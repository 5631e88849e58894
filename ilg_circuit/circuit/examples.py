"""Circuits that use a strip's library, as decks that plain ``ngspice -b FILE`` runs and that write their result."""

from __future__ import annotations

from dataclasses import dataclass

from .. import __version__
from .provenance import FIRST_STEP, LONGEST_STEP, TIGHT_OPTIONS


@dataclass(frozen=True)
class Example:
    """A circuit around the subcircuit ``ilg_strip``.

    ``notes`` say what it shows and what to look at; ``columns`` are the vectors written to the result file, after time;
    ``duration`` [s]; ``options``, ``step`` [s] (ngspice's first; with INTERP that of the result) and ``longest`` [s] of
    the transient.
    """

    name: str
    title: str
    notes: tuple[str, ...]
    circuit: tuple[str, ...]
    columns: tuple[str, ...]
    duration: float
    options: str = TIGHT_OPTIONS
    step: float | None = None
    longest: float | None = None

    @property
    def result(self) -> str:
        """Name of the file that a run writes."""
        return f"{self.name}.txt"

    def text(self, library: str) -> str:
        """The deck, which includes the file ``library``."""
        step = self.duration * FIRST_STEP if self.step is None else self.step
        longest = self.duration * LONGEST_STEP if self.longest is None else self.longest
        return "\n".join(
            [
                self.title,
                f"* written by ilg_circuit {__version__}",
                *(f"* {line}".rstrip() for line in self.notes),
                f"* run: ngspice -b {self.name}.cir; it writes {self.result}: time and, in this order,",
                f"*      {' '.join(self.columns)}",
                f".include {library}",
                "",
                *self.circuit,
                "",
                self.options,
                f".tran {step:g} {self.duration:g} 0 {longest:g} uic",
                ".control",
                "run",
                "set numdgt=12 wr_singlescale wr_vecnames",
                f"wrdata {self.result} {' '.join(self.columns)}",
                "* in batch mode all is done; typed into ngspice's own window the session stays open",
                "if $?batchmode",
                "  quit 0",
                "end",
                ".endc",
                ".end",
                "",
            ]
        )


#: Turns the velocity of a tip grounded through the source Vtip into its displacement: 1 V = 1 mm.
_WAY = ("Vtip tip 0 0", "Fway 0 way Vtip 1", "Cway way 0 1 ic=0")

STEP = Example(
    "step",
    "A 4 V step on a strip whose tip is free",
    (
        "Look at i(vdrive), the current in ampere (of the source, so it is negative), and v(way), the displacement of",
        "the tip, 1 V = 1 mm: it overshoots at 48 s and settles at 3.98 mm. With these options both follow the exact",
        "solution within 1e-6 of their maximum.",
    ),
    ("Vdrive plus 0 4", "X1 plus 0 tip ilg_strip", "* free tip: no force, and the velocity flows into Vtip", *_WAY),
    ("i(vdrive)", "v(way)"),
    300.0,
)

MASS = Example(
    "mass_on_tip",
    "A square wave on a strip that carries 20 mg at its tip",
    (
        "A mass of m kg is an inductor of 1000 m henry at the tip pin: here 2e-5 kg, 20 mH. v(tip) is the force on it,",
        "1 V = 1 uN; v(way) its displacement, 1 V = 1 mm; i(vdrive) the current in ampere, of the source.",
        "Look at the force: it rings with mass and bending stiffness, while the displacement hardly shows it.",
    ),
    (
        "Vdrive plus 0 PWL(0 4 15 4 15.000001 0 30 0 30.000001 4 45 4 45.000001 0 60 0)",
        "X1 plus 0 tip ilg_strip",
        "Lmass tip moving 0.02 ic=0",
        "* the velocity of the mass, from its current",
        "Vtip moving 0 0",
        "Fway 0 way Vtip 1",
        "Cway way 0 1 ic=0",
    ),
    ("i(vdrive)", "v(tip)", "v(way)"),
    60.0,
)

SENSOR = Example(
    "sensor",
    "Two strips as sensors: their tips are moved to and fro, one feeds an open circuit, one a short circuit",
    (
        "A current drawn from the tip pin is a velocity towards the anode: 0.5 mm/s at its largest, 0.05 Hz, which",
        "moves the tip by 3.2 mm from peak to peak. Look at v(open), the open-circuit voltage in volt across 10 Gohm,",
        "and i(vshort), the short-circuit current in ampere that flows out of the plus pin.",
        "Both are tiny, below a nanovolt and a nanoampere: the model's N is the same both ways, and the gel is soft.",
    ),
    (
        "Iopen open_tip 0 SIN(0 0.5 0.05)",
        "Xopen open 0 open_tip ilg_strip",
        "Rmeter open 0 1e10",
        "Ishort short_tip 0 SIN(0 0.5 0.05)",
        "Xshort short 0 short_tip ilg_strip",
        "Vshort short 0 0",
    ),
    ("v(open)", "i(vshort)"),
    120.0,
    # signals far below any absolute tolerance: the step's length decides
    longest=0.005,
)

AMPLIFIER = Example(
    "amplifier",
    "An amplifier with a current limit of 100 mA drives a strip",
    (
        "The operational amplifier multiplies 1 V by 4; a strip at rest wants 0.2 A, so at first the limit holds.",
        "Look at v(out), the voltage on the strip: it starts at 1.9 V and rises while the current i(vsense) stays at",
        "0.1 A; from 4 V on the amplifier controls again. v(way) is the displacement, 1 V = 1 mm.",
        "Macromodel: input difference -> current -> R and C (gain 1e5, 100 kHz); diodes to the supplies limit the",
        "voltage; diodes across what stands before the output resistor limit the current: 0.5 V over 5 ohm.",
    ),
    (
        "Vin in 0 PWL(0 0 1m 1)",
        "* gain 4: from out back to the inverting input",
        "Rup feedback 0 10k",
        "Rdown out feedback 30k",
        "Xamp in feedback out limited_amplifier",
        "Vsense out plus 0",
        "X1 plus 0 tip ilg_strip",
        *_WAY,
        "",
        ".subckt limited_amplifier positive negative out",
        "Gstage 0 stage positive negative 1m",
        "Rstage stage 0 100meg",
        "Cstage stage 0 1.59n ic=0",
        "* supplies: the stage cannot leave -6 V to 6 V",
        "Vhigh high 0 6",
        "Vlow low 0 -6",
        "Dhigh stage high limit",
        "Dlow low stage limit",
        "Ebuffer buffer 0 stage 0 1",
        "Rout buffer out 5",
        "* limits: the stage cannot differ from the output by more than 0.48 V and a diode's 0.02 V",
        "Emost most_ref 0 out 0 1",
        "Vmost most most_ref 0.48",
        "Dmost stage most limit",
        "Vleast most_ref least 0.48",
        "Dleast least stage limit",
        ".model limit D(is=1e-12 n=0.04)",
        ".ends limited_amplifier",
    ),
    ("v(out)", "i(vsense)", "v(way)"),
    60.0,
)

BRIDGE = Example(
    "h_bridge",
    "An H-bridge drives a strip with 1 kHz pulses; a second strip gets the same voltage without pulses",
    (
        "Supply 5 V, pulses of 80 %: 4 V in the mean. A switch has 0.5 ohm, and two of them carry the current at any",
        "time, so the strip without pulses hangs on 4 V behind 1 ohm. Set Vdir to 5 V, and the other leg is up.",
        "Look at v(pulsed) and v(steady): the charge that went into each strip, 1 V = 1 C, so that differences over",
        "whole milliseconds are mean currents; and at v(way), v(steady_way): the displacements, 1 V = 1 mm.",
        "The momentary current is another matter: to a pulse the strip is 19 ohm, so it jumps by a quarter ampere.",
    ),
    (
        "Vsupply supply 0 5",
        "Vhalf half 0 2.5",
        "Vpwm pwm 0 PULSE(0 5 0 1u 1u 799u 1m)",
        "Vdir dir 0 0",
        "* left leg: up while pwm is high; right leg: up while dir is high",
        "S1 supply left pwm half switch",
        "S2 left 0 half pwm switch",
        "S3 supply right dir half switch",
        "S4 right 0 half dir switch",
        ".model switch SW(vt=0 vh=0 ron=0.5 roff=10meg)",
        "Vpulsed left plus 0",
        "X1 plus right tip ilg_strip",
        *_WAY,
        "Fpulsed 0 pulsed Vpulsed 1",
        "Cpulsed pulsed 0 1 ic=0",
        "",
        "Vmean mean 0 4",
        "Rswitches mean steady_plus 1",
        "X2 steady_plus 0 steady_tip ilg_strip",
        "Vsteady_tip steady_tip 0 0",
        "Fsteady_way 0 steady_way Vsteady_tip 1",
        "Csteady_way steady_way 0 1 ic=0",
        "Fsteady steady 0 Vmean 1",
        "Csteady steady 0 1 ic=0",
    ),
    ("v(pulsed)", "v(steady)", "v(way)", "v(steady_way)"),
    10.0,
    # pulses set the steps; only every 10 ms of them goes to the file
    options=".options reltol=1e-4 chgtol=1e-4 interp",
    step=0.01,
    longest=1e-4,
)


#: Parameters [m] of the gripper's fingers.
FINGERS: tuple[dict[str, float], ...] = (
    {},
    {"width": 4e-3},
    {"width": 8e-3, "thickness": 0.4e-3},
    {"length": 30e-3, "free_length": 25e-3},
    {"length": 45e-3, "free_length": 40e-3, "thickness": 0.6e-3},
)


def _gripper() -> Example:
    lines = ["Vdrive drive 0 PWL(0 3 30 3 30.000001 -3 60 -3)", "Rdrive drive out 2"]
    for k, finger in enumerate(FINGERS, 1):
        given = " ".join([f"X{k} out 0 tip{k} ilg_strip", *(f"{name}={value:g}" for name, value in finger.items())])
        lines += [given, f"Vtip{k} tip{k} 0 0", f"Fway{k} 0 way{k} Vtip{k} 1", f"Cway{k} way{k} 0 1 ic=0"]
    return Example(
        "gripper",
        "A gripper of five strips of different sizes on one driver",
        (
            "One subcircuit, five instances: each says only what is not as in the header of the library, in metres.",
            "The driver has 2 ohm and gives 3 V, after 30 s -3 V. Look at v(way1) to v(way5), the displacements,",
            "1 V = 1 mm: a thin and a long finger move most, the width does not matter; and at i(vdrive), what the",
            "driver must deliver, in ampere, of the source.",
        ),
        tuple(lines),
        ("i(vdrive)", "v(out)", *(f"v(way{k})" for k in range(1, len(FINGERS) + 1))),
        60.0,
    )


GRIPPER = _gripper()

EXAMPLES = (STEP, MASS, SENSOR, AMPLIFIER, BRIDGE, GRIPPER)
