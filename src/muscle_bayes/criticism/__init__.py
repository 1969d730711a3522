"""Checks of a fitted model against runs that it has seen and runs that it has not."""
