# %% [markdown]
# # The muscle: nine parameters, and which of them a staircase identifies
#
# **You will learn** how to estimate the muscle's nine parameters, and which of them the runs leave open.
#
# A coiled nylon thread shortens when it is heated, and it remembers: part of its length relaxes over
# minutes, faster when hot. The thesis describes it by three elements: a spring (MODULUS), a
# contraction that depends on temperature (OFFSET), and a spring beside a damper (HYST). These have
# nine parameters. The thesis set two of them by hand, because its data did not identify them.
#
# We ask for all nine at once, and for what the data do *not* say. **Synthetic data** with the
# thesis' own numbers as truth.

# %%
# %matplotlib inline
from pathlib import Path

import muscle_bayes as mb

_ = mb.keep_compiled_code()

# %% tags=["parameters"]
KEPT = Path("../reports/notebooks")
EFFORT = "quick"

# %% [markdown]
# ## Three staircases
#
# A load hangs, the heater climbs in steps and returns to the room, three times over. The same is done
# with three loads.

# %%
runs = mb.load_example("staircases")
mb.plot_run(runs[0])

# %% [markdown]
# ## First the fixture, then the muscle
#
# The posterior of the rotor, from the spring records, is the prior of *J* and *D* here. So the
# uncertainty of the first fit enters the second.

# %%
if not (KEPT / "fixture.nc").exists():
    mb.fit(mb.load_example("springs"), effort=EFFORT).save(KEPT / "fixture.nc")
if not (KEPT / "muscle.nc").exists():
    fixture = mb.load(KEPT / "fixture.nc")
    mb.fit(runs, effort=EFFORT, given=fixture).save(KEPT / "muscle.nc")
muscle = mb.load(KEPT / "muscle.nc")
muscle

# %%
mb.plot_posterior(muscle, mb.TABLE_1["coulomb"] | mb.TABLE_2, "muscle")

# %% [markdown]
# ## Read the wide ones
#
# Some posteriors are as wide as their priors. That is no failure of the sampler but the answer. At
# rest the constant of the contraction and both minimum forces only add up to one length. Three loads
# do not separate them.

# %%
mb.identify(muscle)

# %% [markdown]
# Whoever needs these numbers one by one needs another experiment, not a longer fit. Whoever wants to
# predict motion needs only their sum, and that is known well: *Checks* predicts a run that the fit
# has never seen.
