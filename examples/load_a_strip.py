# %% [markdown]
# # A strip
#
# A preset or a TOML file: geometry, gel, coupling from voltage to motion.

# %%
import ilg_circuit as ilg

strip = ilg.load("paper")
print(strip)

# %% [markdown]
# A changed copy: names as in the file, values with units.

# %%
thinner = strip.with_(thickness="0.4 mm")
print(f"{strip.geometry.thickness:g} m, {thinner.geometry.thickness:g} m")
