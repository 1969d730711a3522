"""The joint to be controlled: plant, heaters, sensors, and draws of everything unknown about it."""
