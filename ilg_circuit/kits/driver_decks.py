"""Decks of a kit for what drives the strip: H-bridge, amplifier with a current limit, position loop."""

from __future__ import annotations

from ..circuit.deck import transient_lines
from ..units import format_quantity
from .decks import STRIP, Plan, finished, steps
from .loop import rounded
from .subcircuit import NAME

#: Pulses of the H-bridge: period [s], part of it high, dead time and edges [s], and how many are run.
_PERIOD, _DUTY, _DEAD, _EDGE, _PULSES = 1e-3, 0.8, 10e-6, 1e-6, 20
#: Tolerances of the bridge: tighter ones take edges apart without end, where a ladder has fast sections.
_OPTIONS = ".options reltol=1e-6 trtol=1 abstol=1e-10 vntol=1e-8 chgtol=1e-4 method=trap"
#: Supplies of the amplifier in parts of the voltage that it gives.
_HEADROOM = 1.5


def h_bridge(made: Plan) -> str:
    """Return the deck of an H-bridge with dead time, its pulses as large in the mean as the drive's largest voltage."""
    supply = rounded(made.level / _DUTY, 3)
    duration = _PULSES * _PERIOD
    return finished(
        f"An H-bridge with dead time drives the strip with pulses of {format_quantity(supply, 'V', 3)}",
        [
            "The left leg pulses, the right leg holds one end: down with forward=1, up with forward=0.",
            "Within a leg one switch opens before the other closes; in the dead time the diodes carry the current.",
            "v(strip) is the voltage on the strip, i(vsense) its current: to a pulse the strip is a resistor, so the",
            "current jumps with every edge. i(vsupply) is what the supply gives, with a minus; v(position) in mm.",
        ],
        [
            f".param supply={supply!r} period={_PERIOD!r} duty={_DUTY!r} dead={_DEAD!r} edge={_EDGE!r} forward=1",
            "Vsupply supply 0 {supply}",
            "* a switch is closed while its gate is at 1 V",
            "Vlefthigh lefthigh 0 PULSE(0 1 {dead} {edge} {edge} {duty*period-dead-2*edge} {period})",
            "Vleftlow leftlow 0 PULSE(0 1 {duty*period+dead} {edge} {edge} {(1-duty)*period-dead-2*edge} {period})",
            "Vrighthigh righthigh 0 {1-forward}",
            "Vrightlow rightlow 0 {forward}",
            "S1 supply left lefthigh 0 switch",
            "S2 left 0 leftlow 0 switch",
            "S3 supply right righthigh 0 switch",
            "S4 right 0 rightlow 0 switch",
            "D1 left supply body",
            "D2 0 left body",
            "D3 right supply body",
            "D4 0 right body",
            ".model switch SW(vt=0.5 vh=0 ron=0.5 roff=10meg)",
            ".model body D(is=1e-12 n=1)",
            "Vsense left plus 0",
            f"X1 plus right tip position {NAME}",
            "Vtip tip 0 0",
            "Estrip strip 0 plus right 1",
            *transient_lines(
                duration,
                _PERIOD / 50,
                _PERIOD / 50,
                "v(strip) i(Vsense) v(position)",
                "i(Vsupply) v(left) v(right)",
                first=_EDGE / 10,
                options=_OPTIONS,
            ),
        ],
    )


def amplifier(made: Plan) -> str:
    """Return the deck of an operational amplifier with a current limit."""
    limit = format_quantity(made.current_limit, "A", 3)
    rail, step = rounded(_HEADROOM * made.level), made.level / 4
    return finished(
        f"An amplifier with a current limit of {limit} drives the strip",
        [
            "It gives four times its input; a step wants more current than it may give, so the limit holds at first.",
            "v(plus) is the voltage on the strip, i(vsense) its current, v(position) the position, 1 V = 1 mm.",
            "Macromodel: input difference, current, R and C (gain 1e5, 100 kHz); diodes to the supplies limit the",
            "voltage; diodes across what stands before the output resistor limit the current, at 0.5 V over it.",
        ],
        [
            f"Vin in 0 PWL(0 0 1m {step!r})",
            "Rup feedback 0 10k",
            "Rdown drive feedback 30k",
            f"Xamp in feedback drive limited_amplifier most={made.current_limit!r} rail={rail!r}",
            *STRIP,
            ".subckt limited_amplifier positive negative out",
            "+ params: most=0.1 rail=6",
            "Gstage 0 stage positive negative 1m",
            "Rstage stage 0 100meg",
            "Cstage stage 0 1.59n ic=0",
            "Vhigh high 0 {rail}",
            "Vlow low 0 {-rail}",
            "Dhigh stage high limiter",
            "Dlow low stage limiter",
            "Ebuffer buffer 0 stage 0 1",
            "Rout buffer out {0.5/most}",
            "* the stage cannot differ from the output by more than 0.48 V and a diode's 0.02 V",
            "Emost ref 0 out 0 1",
            "Vmost most ref 0.48",
            "Dmost stage most limiter",
            "Vleast ref least 0.48",
            "Dleast least stage limiter",
            ".model limiter D(is=1e-12 n=0.04)",
            ".ends limited_amplifier",
            *transient_lines(made.duration, *steps(made.duration), "v(plus) i(Vsense) v(position)"),
        ],
    )


#: A PI controller u = gain e + integral, e = reference - sensed, limited; what the limit takes off flows back.
_CONTROLLER = (
    ".subckt pi_controller reference sensed out",
    "+ params: gain=1 reset=1 most=1",
    "Eerror error 0 reference sensed 1",
    "Gforward 0 integral error 0 {gain/reset}",
    "Gback 0 integral limited wanted {1/reset}",
    "Cintegral integral 0 1 ic=0",
    "Rintegral integral 0 1e12",
    "Egain wanted between error 0 {gain}",
    "Eintegral between 0 integral 0 1",
    "* a resistor and two diodes limit the voltage: 0.02 V are theirs",
    "Rlimit wanted limited 1k",
    "Vhigh high 0 {most-0.02}",
    "Vlow low 0 {0.02-most}",
    "Dhigh limited high limiter",
    "Dlow low limited limiter",
    ".model limiter D(is=1e-12 n=0.04)",
    "Eout out 0 limited 0 1",
    ".ends pi_controller",
)


def _controller(made: Plan) -> str:
    loop = made.loop
    return f"Xpi reference sensed drive pi_controller gain={loop.gain!r} reset={loop.reset!r} most={loop.limit!r}"


def _described(made: Plan) -> list[str]:
    loop = made.loop
    return [
        f"PI: {loop.gain:g} V/mm (1 + 1/({loop.reset:g} s s)), output limited to {loop.limit:g} V either way,",
        f"with back-calculation; {loop.text},",
        f"largest sensitivity {loop.sensitivity:.2f}; no delay of sensor or computer is in it",
    ]


def position_loop(made: Plan) -> str:
    """Return the deck of a step of the position loop's set-point."""
    return finished(
        f"A PI loop moves the tip to {made.loop.reference:g} mm",
        [*_described(made), "v(reference) and v(position): 1 V = 1 mm; v(plus) is the voltage, i(vsense) the current"],
        [
            f"Vreference reference 0 PWL(0 0 1u {made.loop.reference!r})",
            _controller(made),
            "Vsensor position sensed 0",
            *STRIP,
            *_CONTROLLER,
            *transient_lines(made.duration, *steps(made.duration), "v(reference) v(position) v(plus) i(Vsense)"),
        ],
    )


def loop_gain(made: Plan) -> str:
    """Return the deck of the loop gain, the loop closed for its operating point and open for signals."""
    return finished(
        "Loop gain of the position loop",
        [
            *_described(made),
            "The coil closes the loop for the operating point and opens it for signals; v(loop) is the loop gain.",
            "ngspice gives vp in radians; the margin is the phase at which vdb falls through 0, and 180 degrees more.",
        ],
        [
            f"Vreference reference 0 {made.loop.reference!r}",
            _controller(made),
            "Lbreak position sensed 1e12",
            "Cbreak sensed test 1e12",
            "Vtest test 0 dc 0 ac 1",
            *STRIP,
            *_CONTROLLER,
            "Eloop loop 0 0 position 1",
            ".print ac vdb(loop) vp(loop)",
            ".meas ac crossover when vdb(loop)=0 fall=last",
            ".meas ac phase find vp(loop) when vdb(loop)=0 fall=last",
            f".ac dec 100 {made.lowest:.6g} {made.highest:.6g}",
        ],
    )
