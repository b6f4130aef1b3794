"""The one base of every error that is the user's to mend.

A subclass lives beside its cause, takes facts, and builds its own sentence: what, where, what to do.
Nothing below `cli/` prints or exits; the net in `cli/main.py` turns these into one line and exit code 2.
"""


class SonarlogError(Exception):
    """Something the user can mend: a bad argument, a bad file, no robot."""
