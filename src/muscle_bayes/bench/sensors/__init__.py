"""What a board can be wired to besides potentiometer and meter: one entry a sensor in SENSORS."""
