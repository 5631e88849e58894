# %% [markdown]
# # What a strip does under a square wave
#
# Current, displacement, force, charge and energy; by ngspice.

# %%
import ilg_circuit as ilg

run = ilg.simulate("paper", "square:-2V..2V,60s", "300 s")
print(run.summary())

# %%
axes = run.plot()

# %% [markdown]
# The suffix says what is written: a picture, a table, all of it as JSON or as a page.

# %%
run.save("square.png")
run.save("square.csv")
print(f"{1e3 * abs(run.displacement).max():.2f} mm at most")
