"""What is done to a bench: SEQUENCE.toml, the usual regimes, stages as they pass."""
