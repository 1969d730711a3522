"""Bayesian calibration of artificial muscles and of the rigs that test them."""
