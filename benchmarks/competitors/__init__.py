"""Ways to find the log posterior and its gradient, one file each."""
