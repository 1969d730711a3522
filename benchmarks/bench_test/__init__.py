"""Trials of the whole bench in simulation, each of which ends in figures."""
