# %% [markdown]
# # Parameters with standard errors and intervals
#
# The step begins somewhere between two readings, which widens what depends on it; `onset` states it where it is known.

# %%
import numpy as np

import ilg_circuit as ilg

time = np.arange(-5.0, 60.0, 0.2)
after = np.maximum(time, 0.0)
current = np.where(time < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-after / 7))
current += np.random.default_rng(2).normal(0, 5e-4, len(time))
step = {"time": time, "voltage": np.where(time < 0, 0.0, 4.0), "current": current}

# %%
for onset in (None, "0 s"):
    fit = ilg.identify(**step, model="rc", onset=onset)
    for name in ("dc_resistance", "dynamic_resistance", "capacitance"):
        found = fit[name]
        low, high = found.interval
        print(f"{name:20} {found.value:8.4g} +- {found.stderr:.2g} {found.unit}, 95 %: {low:.4g} to {high:.4g}")
    print(f"onset {'left open' if onset is None else 'stated'}\n")
