"""Lets the figures' tests use the examples of the checks' tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "criticism"))
