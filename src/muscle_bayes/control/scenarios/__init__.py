"""What happens to a joint: courses of setpoint and load."""
