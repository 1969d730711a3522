"""Effects on the rotor and its bearing."""
