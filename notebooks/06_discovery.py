# %% [markdown]
# # Discovery: what is missing from the model?
#
# **You will learn** how to find where a model disagrees with runs, and which effect it lacks.
#
# The thesis found its missing effect, coils that touch, by looking at a misfit until somebody had an
# idea. Here that is a method. Find *where* a model disagrees with the runs. Weigh *which* effect of a
# catalogue explains it. Add it only if unseen readings are predicted better. Otherwise say "none" or
# "unknown".
#
# To see whether it works we hide something. **Synthetic data**: four spring records of a rig in
# whose bearing there is viscous friction, beside the dry friction that the model knows.

# %%
# %matplotlib inline
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp

import muscle_bayes as mb

_ = mb.keep_compiled_code()

from muscle_bayes.data import write_run
from muscle_bayes.twin import Rig, make_effect, simulate, spring, spring_rig

# %% tags=["parameters"]
CANDIDATES = ("viscous-friction", "bias-torque", "quadratic-drag", "stribeck-friction")

# %%
rig = spring_rig(Rig())
hidden = make_effect("viscous-friction", coefficient=1e-3)  # N m s
rig = replace(rig, truth=replace(rig.truth, effects=(hidden,)))
folder = Path(mkdtemp())
for number, mass in enumerate((0.100, 0.110, 0.118, 0.126), 1):
    run = simulate(rig, spring(mass), (11, number))
    write_run(folder, f"spring-{number}", run.log, run.metadata)
runs = mb.read_runs([folder])

# %% [markdown]
# ## Search
#
# One run is held out: only its first part is used, for its own zero and start. To be quick only a few
# candidates are tried here. Without `candidates`, all that the runs could show are tried.

# %%
found = mb.discover(runs, hold_out=["spring-4"], candidates=CANDIDATES)
found

# %%
print(found)

# %% [markdown]
# ## Where
#
# Residuals of each run that was fitted, before and after. Shaded is where they are larger than noise
# and uncertain parameters allow, with the probability that any window would look so bad by chance.

# %%
origins = {run.name: run.metadata.origin for run in runs}
mb.plot_misfit(found, origins)

# %%
found.located

# %% [markdown]
# ## Which

# %%
mb.plot_probabilities(found)

# %% [markdown]
# ## How much, and does it help where nobody looked?
#
# The parameter, beside the truth that we hid; and the run that was held out.

# %%
for step in found.steps:
    for name, told in step.parameters.items():
        bounds = f"90 %: {told.low:.3g} to {told.high:.3g}"
        print(f"{step.added}.{name}: {told.median:.3g} {told.unit}, {bounds}")
print(f"hidden: {hidden}")

# %%
mb.plot_before_after(found, "spring-4", origins["spring-4"])

# %% [markdown]
# If effects tie, `found.ties` names them and `found.next_experiment` says what to record
# next.
#
# On the command line: `muscle-bayes discover RUN... --hold-out NAME`.
