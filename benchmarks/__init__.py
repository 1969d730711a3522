"""Comparisons of this project's computations with others'."""

from pathlib import Path

RESULTS = Path(__file__).parent / "results"
"""Where each benchmark leaves its measurements, as JSON."""
