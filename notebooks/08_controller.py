# %% [markdown]
# # Controller: gains for every muscle that the data allow
#
# **You will learn** how to tune gains over a posterior, and to test them on draws that were not used.
#
# Two muscles pull on one rotor from both sides; heating one turns it. The thesis tuned such a joint
# for one set of parameters. We do not have one set, we have a posterior: a controller should work
# for all of it.
#
# **Everything here is simulated**, and the posteriors come from synthetic runs. Nobody has built
# this joint with our bench.

# %%
# %matplotlib inline
from pathlib import Path

import muscle_bayes as mb

mb.keep_compiled_code()

from muscle_bayes.control.batch import Bank
from muscle_bayes.control.closed_loop import Clock
from muscle_bayes.control.criteria import CVaR
from muscle_bayes.control.draws import joint_draws
from muscle_bayes.control.gains import Gains
from muscle_bayes.control.header import gains_header, on_the_bench
from muscle_bayes.control.heater_fit import fit_heater
from muscle_bayes.control.linear import snapshot_gains
from muscle_bayes.control.scenarios import STEP, thesis_scenarios
from muscle_bayes.control.study import robustness
from muscle_bayes.control.tune import Effort, tune

# %% tags=["parameters"]
KEPT = Path("../reports/notebooks")
EFFORT = "quick"
DRAWS = 32
TUNING = Effort(starts=16, scout_draws=8, refined=1, steps=6)

# %%
springs = mb.load_example("springs")
if not (KEPT / "fixture.nc").exists():
    mb.fit(springs, effort=EFFORT).save(KEPT / "fixture.nc")
if not (KEPT / "fixture-linear.nc").exists():
    mb.fit(springs, "linear", effort=EFFORT).save(KEPT / "fixture-linear.nc")
if not (KEPT / "muscle.nc").exists():
    fixture = mb.load(KEPT / "fixture.nc")
    mb.fit(mb.load_example("staircases"), effort=EFFORT, given=fixture).save(KEPT / "muscle.nc")
muscle = mb.load(KEPT / "muscle.nc")
bearing = mb.load(KEPT / "fixture-linear.nc")

# %% [markdown]
# ## The heater
#
# How fast does a tube heat and cool? The temperatures of our own runs tell.

# %%
heater = fit_heater(mb.load_example("sawtooth"))
heater

# %% [markdown]
# ## Many joints
#
# A draw is one complete joint: bearing, muscles, heater. Half of the draws are tuned on, the other
# half is kept apart to judge by.

# %%
draws = joint_draws(muscle, heater.draws, 2 * DRAWS, fixture=bearing)
tuned_on, kept_apart = draws.split(DRAWS)
draws

# %% [markdown]
# ## Gains as in the thesis
#
# PI gains for one joint, the mean of the draws, linearised. They are judged as they come: the
# integers of our board would not hold all such gains.

# %%
classic = snapshot_gains(tuned_on, STEP)
classic

# %% [markdown]
# ## Gains for all draws
#
# Two of the thesis' nine scenarios: a step, and a setpoint that swings. Small is made the CVaR, the
# mean of the worst 5 % of the costs: we mind the muscle that is unlucky, not the average one.

# %%
chosen = [one for one in thesis_scenarios() if one.name in ("step", "setpoint-sine-0.1592")]
start = Gains(proportional=1.0, integral=1.0)
found = tune(Bank(tuned_on, Clock(start.period)), chosen, CVaR(), start, effort=TUNING)
found

# %%
robust = on_the_bench(found.gains, draws.design)

# %% [markdown]
# ## Judged on draws that were kept apart

# %%
bank = Bank(kept_apart, Clock(start.period), seed=1)
results = {"classic": robustness(bank, classic, chosen), "robust": robustness(bank, robust, chosen)}
results["classic"]

# %%
results["robust"]

# %%
mb.plot_scenario(results["classic"], chosen[1])

# %%
mb.plot_scenario(results["robust"], chosen[1])

# %% [markdown]
# Read both, and every scenario, before you believe in "robust": gains that mind the worst case give
# something up in the ordinary one, and which scenarios are counted decides what is won.
#
# ## Onto the board
#
# The firmware knows integers only, and these are what was judged above.

# %%
print(gains_header(robust, draws.design, "from a notebook, on synthetic data"))
