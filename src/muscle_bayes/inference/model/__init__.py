"""The statistical model: priors, predictions, likelihood."""
