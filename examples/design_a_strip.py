"""The inverse problem: which strip bends by 4 mm, pushes with 0.1 uN and takes the least energy? And the trade-off.

Run: python examples/design_a_strip.py
"""

from ilg_circuit.study.design import design

report = design(
    "paper",
    "step:4V",
    "300s",
    vary=["thickness=0.2mm:1mm", "free_length=15mm:40mm", "voltage=1V:4V"],
    require=["displacement_final>=4mm", "force_blocked>=0.1uN"],
    minimise="energy",
    pareto="displacement_final,force_blocked",
    points=8,
)
print(report.summary(), *report.warnings, sep="\n")
front = report.front
if front:
    for y, force in zip(front.simulated["displacement_final"], front.simulated["force_blocked"], strict=True):
        print(f"{1e3 * y:.2f} mm with {1e9 * force:.0f} nN")
