# %% [markdown]
# # The bench, without the bench
#
# **You will learn** how to record a sequence through the real firmware, and what happens on a fault.
#
# The firmware of both boards runs here in a simulated processor, instruction for instruction, and the
# recorder is the program that drives the real boards. Only rotor, muscle and heaters are a
# simulation. So a sequence can be tried, and broken, before anything gets hot.
#
# **What is recorded here is synthetic**, and says so in its metadata.
#
# It needs the firmware built once: `make firmware`.

# %%
# %matplotlib inline
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from matplotlib import pyplot as plt

import muscle_bayes as mb
from muscle_bayes.bench.heat.settling import settlings
from muscle_bayes.bench.recording.guard import RecordingError
from muscle_bayes.bench.recording.run_file import read_events
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence import Limits, Sequence, Stage
from muscle_bayes.bench.sequences.sequence_file import to_toml
from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
from muscle_bayes.bench.simulation.recording import (
    NOTES,
    SimulatedOperator,
    rig_tables,
    simulated_devices,
)
from muscle_bayes.twin.plant.rig import Rig

# %% [markdown]
# ## A sequence
#
# What is done to the muscle: warm, warmer, off. Written to a file it is what
# `muscle-bayes record` takes.

# %%
sequence = Sequence(
    name="first",
    load=0.100,
    limits=Limits(reconnect_time=3.0),
    stage=(
        Stage(setpoint_a=25.0, duration=3.0),
        Stage(setpoint_a=45.0, duration=15.0),
        Stage(setpoint_a=60.0, duration=15.0),
        Stage(duration=10.0),
    ),
)
print(to_toml(sequence, "three steps"))

# %% [markdown]
# ## Record

# %%
folder = Path(mkdtemp())
with SimulatedBench(TwinPlant(load=0.100)) as bench:
    session = Session(
        sequence,
        folder / "sequence.toml",
        folder,
        simulated_devices(bench),
        SimulatedOperator(bench, 0.100),
        origin="synthetic",
        rig=rig_tables(Rig()),
        notes=NOTES,
        load=0.100,
    )
    session.devices.open()
    (outcome,) = session.record()
print(f"{outcome.rows} rows in {outcome.duration:.1f} s, {outcome.figures['lost']} samples lost")

# %%
(run,) = mb.read_runs([folder / "first.csv"])
mb.plot_run(run)

# %% [markdown]
# How were the setpoints met? (15 s are short for this heater, so what was reached is printed.)

# %%
for one in settlings(run):
    print(
        f"{one.setpoint:.0f} °C: {'settled' if one.settled else 'not settled'}, "
        f"overshoot {one.overshoot:.1f} °C, {one.error:+.2f} °C off at the end"
    )

# %% [markdown]
# ## Pull the plug
#
# The heater board's line is pulled eight seconds in, while it heats. Nobody tells the board; it has
# to notice. We watch the duty at its pins, every millisecond.

# %%
folder = Path(mkdtemp())
duty: list[float] = []
with SimulatedBench(TwinPlant(load=0.100)) as bench:

    def watch(milliseconds: int) -> None:
        duty.append(max(bench.heater.duties))
        if milliseconds == 8000:
            bench.heater_board.pull()

    bench.listeners.append(watch)
    session = Session(
        sequence,
        folder / "sequence.toml",
        folder,
        simulated_devices(bench),
        SimulatedOperator(bench, 0.100),
        origin="synthetic",
        rig=rig_tables(Rig()),
        notes=NOTES,
        load=0.100,
    )
    session.devices.open()
    try:
        list(session.record())
    except RecordingError as error:
        print(str(error).replace(str(folder), "..."))

# %%
time = np.arange(1, len(duty) + 1) / 1000.0
pulled = 8.0
off = time[(time > pulled) & (np.array(duty) == 0.0)][0]
figure, axis = plt.subplots(figsize=(7, 2.4), layout="constrained")
axis.plot(time, duty, drawstyle="steps-post")
axis.axvline(pulled, linestyle=":", color="black")
axis.set(xlim=(pulled - 2, pulled + 2), xlabel="time [s]", ylabel="duty of heater A [of 255]")
axis.set_title("dotted: the line is pulled")
print(f"heater off {off - pulled:.2f} s after the line was pulled")

# %% [markdown]
# The rows recorded until then are whole, and the events tell the rest:

# %%
for event in read_events(folder / "first.csv")[-4:]:
    print(event)

# %% [markdown]
# ## With hardware
#
# The same with `muscle-bayes record first.toml --out runs`. Read *The bench* first: wiring, the
# thermal cut-off, and what to try before you leave it alone.
