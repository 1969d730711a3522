"""What is repaired in a log, by which rule, and the report of it."""
