"""A run recorded: the loop, its guard, the files, and what a person sees meanwhile."""
