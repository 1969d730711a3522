"""What each stage does: a module a step, run in a process of its own by `worker`."""
