"""Ways to draw from the joint posterior, one file each."""
