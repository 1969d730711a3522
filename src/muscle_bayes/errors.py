"""Errors that are the user's to mend: shown as a message, never as a traceback."""


class MuscleBayesError(Exception):
    """What was wrong, where (file, row, column, key) and what to do, in one message."""
