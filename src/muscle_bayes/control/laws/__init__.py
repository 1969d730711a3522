"""Control laws as the board computes them, their gains, and where to look for them."""
