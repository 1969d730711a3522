"""The plant: linkages, elements, friction, load, effects, and the two ways of moving it in time."""
