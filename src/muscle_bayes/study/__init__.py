"""The study: every stage from the shipped runs to the report, run again only where inputs changed."""
