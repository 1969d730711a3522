"""Compiled programs, and how they are run."""
