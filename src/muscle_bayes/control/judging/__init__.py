"""What is asked of a response, what is within reach, and how laws compare."""
