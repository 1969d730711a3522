"""The most probable point, and the evidence for a model."""
