# %% [markdown]
# # Quick start: from log files to a posterior
#
# **You will learn** how to read runs, estimate a rotor's inertia *J* and friction *D*, and see how
# sure they are.
#
# A weight hangs from a disc, a spring holds it, and somebody lets go. The rotor swings, slower and
# slower. At some point it *sticks*: dry friction holds it a little off its balance.
#
# **The data are synthetic.** A simulator that shares no code with the inference wrote them, from the
# values that the thesis printed. That is why we can ask in the end whether the answer is right.

# %%
# %matplotlib inline
from pathlib import Path

import muscle_bayes as mb

_ = (
    mb.keep_compiled_code()
)  # before JAX is imported: the next notebook need not compile all this again

# %% tags=["parameters"]
KEPT = Path("../reports/notebooks")
EFFORT = "quick"

# %% [markdown]
# ## Read
#
# A run is a CSV and a TOML of the same name. Reading repairs what can be repaired by a stated rule,
# and says so. A run knows where it comes from, and shows it. These come with the package; your own
# are read by `mb.read_runs(["FOLDER"])`.

# %%
runs = mb.load_example("springs")
runs[0]

# %%
mb.plot_run(runs[0])

# %% [markdown]
# ## Fit
#
# One call. Which parameters are fitted follows from the runs: without a muscle these are *J* and
# *D*. The potentiometer's zero, the first angle of each run and the noise are unknown too; they are
# sampled along and left out of the table.
#
# What takes long is kept in a folder, and the notebooks after this one look there first.

# %%
kept = KEPT / "fixture.nc"
if not kept.exists():
    mb.fit(runs, effort=EFFORT).save(kept)
fixture = mb.load(kept)
fixture

# %% [markdown]
# The first words matter most: *converged*, or not and why. If they say **NOT CONVERGED**, the chains
# disagree with each other and the numbers are not to be used.
#
# ## Is it right?
#
# Grey is what we believed before, blue what the data made of it, the dashed line the value with
# which the simulator ran.

# %%
mb.plot_posterior(fixture, mb.TABLE_1["coulomb"], "fixture")

# %% [markdown]
# Does the model do what the rotor did? Dots are readings, bands are predictions. Below is what is
# left over: with a good model nothing but noise and the rounding to whole counts.

# %%
prediction = mb.predict(fixture, runs)[0]
check = mb.check(prediction)
mb.plot_prediction(prediction, check, runs[0].metadata.origin)

# %%
check

# %% [markdown]
# About 90 % of the readings should lie inside the 90 % band. A much smaller share means that the
# fit is overconfident, a much larger one that it is too careful.
#
# ## Where next
#
# - *Bring your own rig* does the same for a log that did not come from our bench.
# - *Fixture* asks which friction law it is, and what spring records cannot tell.
# - *Muscle* heats one.
# - On the command line this was `muscle-bayes fit data/spring-*.csv --out fixture.nc`.
