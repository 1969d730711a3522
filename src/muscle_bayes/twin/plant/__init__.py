"""The simulated rig: its parts, and its parameters."""
