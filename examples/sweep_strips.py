"""A random sweep over geometry and stiffness: which strips settle soonest for what they move? Read with xarray.

Needs the extra `study`. Run: python examples/sweep_strips.py
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study import ScenarioTemplate
from ilg_circuit.study.dataset import read_sweep
from ilg_circuit.study.plan import random_plan
from ilg_circuit.study.spec import SweepSpec
from ilg_circuit.study.sweep import sweep

plan = random_plan(["thickness=0.3mm:1mm", "free_length=15mm:40mm", "youngs_modulus=5kPa:50kPa:log"], 200, "sobol")
outputs = ("displacement_peak", "relative_deflection", "force_blocked", "settling_time")
spec = SweepSpec(ScenarioTemplate(PAPER, "step:4V", 300.0), plan, outputs, engine="exact")

with TemporaryDirectory() as folder:
    done = sweep(spec, Path(folder) / "strips.nc", jobs=1)
    with read_sweep(done.path) as data:
        holds = data.where(data.relative_deflection < 0.2, drop=True)
        print(f"{holds.sizes['design']} of {done.summary.count} strips stay within small deflection")
        best = holds.isel(design=int((holds.displacement_peak * holds.force_blocked).values.argmax()))
        print(
            f"most displacement times force: b = {1e3 * best.thickness:.2f} mm, L0 = {1e3 * best.free_length:.1f} mm, "
            f"E = {1e-3 * best.youngs_modulus:.1f} kPa: {1e3 * best.displacement_peak:.2f} mm, "
            f"{1e6 * best.force_blocked:.3f} uN, settled after {best.settling_time:.0f} s"
        )
