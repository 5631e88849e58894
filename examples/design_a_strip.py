"""The inverse problem: which strip bends by 4 mm, pushes with 0.1 uN and takes the least energy? And the trade-off.

Run: python examples/design_a_strip.py
"""

from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study import ScenarioTemplate
from ilg_circuit.study.constraints import limits
from ilg_circuit.study.problem import Objective, DesignProblem, best_design
from ilg_circuit.study.pareto import pareto_front, parse_objectives
from ilg_circuit.study.quantities import quantity
from ilg_circuit.study.requirements import parse_requirements
from ilg_circuit.study.space import Space, parse_ranges
from ilg_circuit.study.threads import one_thread

ranges, fixed = parse_ranges(["thickness=0.2mm:1mm", "free_length=15mm:40mm", "voltage=1V:4V"])
space = Space(ScenarioTemplate(PAPER, "step:4V", 300.0), ranges, fixed, engine="exact")
wanted = parse_requirements(["displacement_final>=4mm", "force_blocked>=0.1uN"], space.names, PAPER)

with one_thread():
    best = best_design(DesignProblem(space, wanted, Objective(quantity("energy", space.names), sense=1)))
    print({name: f"{value:.6g}" for name, value in best.values.items()}, f"{best.simulated['energy']:.3f} J by ngspice")
    for limit in active_constraints(best):
        print(f"1 % more room at {limit.text}: {limit.gain:.2%} less energy")

    aims = parse_objectives("displacement_final,force_blocked", space.names)
    front = pareto_front(DesignProblem(space, wanted, aims[0]), aims, points=8)
for y, force in zip(front.simulated["displacement_final"], front.simulated["force_blocked"], strict=True):
    print(f"{1e3 * y:.2f} mm with {1e9 * force:.0f} nN")
