"""A sampled quantity: its prior, its unit and what it means."""

from typing import NamedTuple

from numpyro import distributions as dist


class Site(NamedTuple):
    """One sampled quantity."""

    prior: dist.Distribution
    unit: str
    meaning: str
