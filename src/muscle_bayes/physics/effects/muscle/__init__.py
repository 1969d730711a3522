"""Effects inside the muscle."""
