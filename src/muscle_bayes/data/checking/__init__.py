"""Checks that a log means what its metadata say: units, magnitudes, endstops, unreadable numbers."""
