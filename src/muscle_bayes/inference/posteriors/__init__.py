"""Posteriors, and what they say of runs."""
