"""Rows of runs on the grids that a solver works on."""
