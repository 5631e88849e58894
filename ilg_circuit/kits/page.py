"""The page of a kit: which file is for what, how each program reads it, and what was not tried."""

from __future__ import annotations

from ..provenance import Provenance
from ..units import format_quantity
from .decks import Plan
from .spread_decks import COUNT, SIGMAS
from .subcircuit import NAME, PINS
from .tolerances import Tolerances

_ALONE = """\
| file | what it does |
|---|---|
| strip.lib | the strip as a subcircuit, `{name} {pins}`; its head lists every parameter |
| strip.kicad_sym | symbol for KiCad 7 and later |
| {name}.asy | symbol for LTspice |
| op.cir | operating point at {level}: {position} and the current at rest |
| ac.cir | admittance and position per volt, {lowest} to {highest} |
| transient.cir | {drive}, {duration} |
| h_bridge.cir | pulses from four switches with dead time and diodes |
| amplifier.cir | an operational amplifier with a current limit of {current} |
| position_loop.cir | a PI loop that moves the tip to {reference:g} mm, {level} at most |
| loop_gain.cir | the loop gain of that: {margin} |
"""

_SPREAD = """\
| corners.cir | the strip as fitted and with each fitted parameter {sigmas:g} standard errors up and down |
| monte_carlo.cir | {count} strips drawn from the fit's covariance: mean and spread of position and current |
"""

_PAGE = """
## Pins

- `plus`, `minus`: the strip's terminals, volt and ampere. Nothing inside leans on ground there, so a bridge may lift
  both.
- `tip`: the mechanical port. 1 V is 1 uN, 1 A is 1 mm/s. Grounded the tip is free, open it is clamped; a load is an
  element from there to ground, as the head of strip.lib says.
- `position`: the way of the tip towards the anode, 1 V a millimetre, from an ideal source to ground. A sensor's gain,
  delay and noise are yours to add. It is where the load acts, L_F from the clamp.

The parameter `static_beam` is {static:g} here. With 0 the beam has mass and damping, and what the motion reflects onto
the terminals is there; with 1 the measured d(s) is the whole motion of the tip.

    X1 plus minus 0 position {name}
    X2 plus minus 0 position {name} static_beam=1 width=10e-3

## ngspice

`ngspice -b transient.cir` in this folder prints a table; `ngspice -b -r out.raw transient.cir` writes all waveforms
with all their digits. The decks have no .control section. In the compatibility modes, `set ngbehavior=lt` and
`set ngbehavior=ps` in a .spiceinit, they give the same answers. The phase of loop_gain.cir is in radians.

The options in the decks and the longest step in .tran are there because a strip takes minutes: without both the
position of the strip of the paper is wrong by 0.05 % of its maximum, with them by less than 0.001 %. Keep them in your
circuits.

## KiCad

Add strip.kicad_sym to the project's symbol libraries. The symbol names strip.lib and its pins for the simulator, so
keep strip.lib beside the schematic. Options and .tran go into the schematic as text.

## LTspice

Put {name}.asy and strip.lib beside the schematic; the symbol includes the library. LTspice puts 1 mohm into
inductors: see the head of strip.lib. Its phase is in degrees.

## PSpice, Xyce

Both want the word `params:` before the parameters of an instance, as in
`X1 plus minus 0 position {name} params: static_beam=1`. PSpice has no SW model: write the bridge's switches as
VSWITCH.

## gnucap

Add `short=1e-7 method=gear noincmode` to the options; the answers are then within 1e-3. It reads op.cir, ac.cir and
transient.cir{gnucap}.

## What was tried, and what was not

The tests of ilg_circuit run every deck in plain ngspice and compare it with the package's own solution. They run all
but monte_carlo.cir in ngspice's LTspice and PSpice modes, too, and op.cir, ac.cir and transient.cir in gnucap. They
read every deck and the LTspice symbol with spicelib's editor, and the KiCad symbol with kiutils. LTspice, PSpice, Xyce
and KiCad themselves were not run.

## What the decks assume

- The strip is linear{linear}, at the temperature and in the liquid in which it was measured.
- The bridge's switches are ideal with 0.5 ohm; the pulses are slower and the dead time longer than in a real driver, so
  that the run is short. Period, duty, dead time and supply are parameters of the deck.
- The amplifier is a macromodel with one pole; its current limit is {current}, half of what a step wants at first.
- The PI loop has no delay and no noise. Its gain is the largest that is stable, keeps abs(1/(1 + L)) below 1.6 and
  asks for no more than twice {level} at first.
"""

_MONTE_CARLO = """
## Tolerances

The strip comes from a fit whose covariance is in strip.lib as a Cholesky factor: `z1` to `z{n}` are standard normal
numbers, all 0 for the strip as fitted, and move its parameters together as the fit leaves them open:

{names}
{fixed}
In ngspice write `z1={{agauss(0,1,1)}}` and so on, a new draw with each run, in LTspice `z1={{gauss(1)}}` with
`.step param run 1 100 1`; or draw them elsewhere, as monte_carlo.cir has them. It is what one strip's measurement
leaves open, not how strips differ from one another.
"""

_MISFIT = """
The covariance is not all that a measurement leaves open. The file of the strip also states what its model left of the
records beyond their noise, rms over the time since a jump and per volt:

{misfit}

No parameter moves that, so corners.cir and monte_carlo.cir are without it. `ilg-circuit simulate --band` has it.
"""

_NO_MONTE_CARLO = """
## Tolerances

There are no corners.cir and monte_carlo.cir here, since the strip's file has no [uncertainty]: it was not fitted, or
from data without noise. `ilg-circuit identify` writes a file that has one; make the kit from that.
"""


def page(made: Plan, tolerance: Tolerances | None, beam: str, origin: Provenance) -> str:
    """Return the page as Markdown."""
    loop, model = made.loop, made.actuator.material.model
    values = {
        "name": NAME,
        "pins": " ".join(PINS),
        "level": format_quantity(made.level, "V", 4),
        "position": format_quantity(1e-3 * made.position, "m", 4),
        "lowest": format_quantity(made.lowest, "Hz", 3),
        "highest": format_quantity(made.highest, "Hz", 3),
        "drive": made.drive.text,
        "duration": format_quantity(made.duration, "s", 4),
        "current": format_quantity(made.current_limit, "A", 3),
        "reference": loop.reference,
        "margin": loop.text,
        "static": 1 if beam == "static" else 0,
        "linear": "" if model.linear else " but for its electron path and capacitances, as fitted",
        "gnucap": "" if model.linear else ", if no capacitance grows with voltage",
    }
    text = f"# Kit of the strip {made.actuator.name}\n\n" + "".join(f"{line}  \n" for line in origin.lines()) + "\n"
    text += _ALONE.format(**values)
    if tolerance is None:
        return text + _PAGE.format(**values) + _NO_MONTE_CARLO
    errors = zip(tolerance.names, tolerance.stderr, strict=True)
    names = "\n".join(f"- {name}, standard error {error:.2g} of its value" for name, error in errors)
    fixed = f"\n{', '.join(tolerance.fixed)}: cannot be moved here, as fitted.\n" if tolerance.fixed else ""
    text += _SPREAD.format(sigmas=SIGMAS, count=COUNT) + _PAGE.format(**values)
    text += _MONTE_CARLO.format(n=len(tolerance.names), names=names, fixed=fixed)
    left = made.actuator.uncertainty.residuals if made.actuator.uncertainty is not None else ()
    told = "\n".join(f"- {each.quantity}: {format_quantity(each.rms, each.unit, 2)}" for each in left)
    return text + (_MISFIT.format(misfit=told) if left else "")
