"""A random sweep over geometry and stiffness: which strips settle soonest for what they move? Read with xarray.

Needs the extra `study`. Run: python examples/sweep_strips.py
"""

from ilg_circuit.study.sweep import sweep

result = sweep(
    "paper",
    "step:4V",
    "300s",
    vary=["thickness=0.3mm:1mm", "free_length=15mm:40mm", "youngs_modulus=5kPa:50kPa:log"],
    random=200,
    method="sobol",
    outputs=["displacement_peak", "relative_deflection", "force_blocked", "settling_time"],
    engine="exact",
    jobs=1,
)
data = result.to_xarray()
holds = data.where(data.relative_deflection < 0.2, drop=True)
print(f"{holds.sizes['design']} of {result.totals.count} strips stay within small deflection")
best = holds.isel(design=int((holds.displacement_peak * holds.force_blocked).values.argmax()))
print(
    f"most displacement times force: b = {1e3 * best.thickness:.2f} mm, L0 = {1e3 * best.free_length:.1f} mm, "
    f"E = {1e-3 * best.youngs_modulus:.1f} kPa: {1e3 * best.displacement_peak:.2f} mm, "
    f"{1e6 * best.force_blocked:.3f} uN, settled after {best.settling_time:.0f} s"
)
