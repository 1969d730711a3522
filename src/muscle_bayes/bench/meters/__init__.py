"""Where temperatures come from."""
