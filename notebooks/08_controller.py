# %% [markdown]
# # Controller: gains for muscles that have not been built yet
#
# **You will learn** how to tune gains over a population of muscles, and to test them on new joints.
#
# Two muscles pull on one rotor from both sides; heating one turns it. The thesis tuned such a joint
# for one set of parameters. But the next muscle will differ from the one that we measured: gains
# should work for it as well.
#
# **Everything here is simulated**, and the posteriors come from synthetic runs. Nobody has built
# this joint with our bench.

# %%
# %matplotlib inline
from pathlib import Path

import muscle_bayes as mb

_ = mb.keep_compiled_code()

from muscle_bayes.control.laws.gains import gains_header
from muscle_bayes.control.plant.design import Design
from muscle_bayes.control.plant.heater_fit import fit_heater
from muscle_bayes.control.scenarios.thesis import thesis_scenarios
from muscle_bayes.control.tune import Effort

# %% tags=["parameters"]
KEPT = Path("../reports/notebooks")
EFFORT = "quick"
DRAWS, JUDGED = 24, 48
TUNING = Effort(starts=16, scouts=8, kept=4, rounds=1, tried=8)

# %%
if not (KEPT / "fixture.nc").exists():
    mb.fit(mb.load_example("springs"), effort=EFFORT).save(KEPT / "fixture.nc")
if not (KEPT / "muscle.nc").exists():
    fixture = mb.load(KEPT / "fixture.nc")
    mb.fit(mb.load_example("staircases"), effort=EFFORT, given=fixture).save(KEPT / "muscle.nc")
muscle = mb.load(KEPT / "muscle.nc")

# %% [markdown]
# ## The population
#
# We have measured one specimen. It identifies the mean of its kind as well as one specimen can. How
# much muscles differ from each other is an assumption until more are measured.

# %%
population = mb.fit_population({"m1": muscle})
population

# %% [markdown]
# ## The heater
#
# How fast does a tube heat and cool? The temperatures of our own runs show it.

# %%
heater = fit_heater(mb.load_example("sawtooth"))
heater

# %% [markdown]
# ## Tune and test
#
# Three of the thesis' nine scenarios. What the best input could do is computed first. Then gains of
# two laws are tuned for the probability of meeting the specifications, and judged on new joints.

# %%
wanted = ("step", "square", "load-step")
chosen = [one for one in thesis_scenarios() if one.name in wanted]
tuned = mb.tune(
    population,
    heater=heater.draws,
    scenarios=chosen,
    laws=["pi", "cascade"],
    draws=DRAWS,
    judged=JUDGED,
    effort=TUNING,
)
result = tuned.judgement
result

# %%
mb.plot_responses(result, [result.recommended, "thesis"])

# %% [markdown]
# Read every panel before you believe in one number: the band is where nine of ten new joints run.
#
# ## Onto the board
#
# The firmware knows integers only, and these are what was judged above.

# %%
print(gains_header(result.gains[result.recommended], Design(), "from a notebook, synthetic data"))
