# %% [markdown]
# # A population of muscles
#
# **You will learn** how to fit several specimens together, and what they say of a muscle that has not been
# built yet.
#
# A posterior of one muscle says how well that muscle is known: to a tenth of a percent. The next muscle
# differs by far more. Whoever tunes gains, or builds ten of them, needs the spread between specimens.
#
# **Synthetic data**: a lot of eight muscles, one staircase each. An independent simulator drew them.

# %%
# %matplotlib inline
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

import muscle_bayes as mb

_ = mb.keep_compiled_code()

# %% tags=["parameters"]
KEPT = Path("../reports/notebooks")
EFFORT = "quick"

# %% [markdown]
# ## The lot
#
# The metadata of each run name its specimen: `specimen = "m3"` under `[element_a]`.

# %%
lot = mb.load_example("lot")
[run.name for run in lot]

# %% [markdown]
# ## One after the other, then together
#
# Every specimen is fitted on its own, given the fixture that they share. Then a hierarchical model
# estimates their mean and their spread.

# %%
if not (KEPT / "fixture.nc").exists():
    mb.fit(mb.load_example("springs"), effort=EFFORT).save(KEPT / "fixture.nc")
fixture = mb.load(KEPT / "fixture.nc")
population = mb.fit_population(lot, given=fixture)
population

# %% [markdown]
# `spread` is relative: 0.08 of `modulus` means that the next muscle's stiffness differs by 8 %. Eight
# specimens leave the spread itself uncertain, and so does the interval.
#
# ## The next muscle
#
# Draws of muscles that have not been built yet. They scatter by the spread, and by what is not known of it.

# %%
muscles = population.new_muscles(1000, seed=1)
low, high = np.quantile(muscles["K_modulus"], [0.05, 0.95])
print(f"K_modulus of the next muscle: {low:.0f} to {high:.0f} N/m with 90 % probability")

figure, axis = plt.subplots(figsize=(6, 3), layout="constrained")
axis.plot(muscles["K_modulus"], muscles["K_hyst"], ".", alpha=0.3, label="muscles to come")
axis.set(xlabel="K_modulus [N/m]", ylabel="K_hyst [N/m]")
axis.legend()

# %% [markdown]
# `mb.tune(population, ...)` tunes gains over such muscles. On the command line:
#
# ```sh
# muscle-bayes population data/lot --given fixture.nc --out population.nc
# muscle-bayes tune population.nc --out gains.toml
# ```
