"""Recording, replay, runs, diff and viz for sonar robots; the algorithm itself is in `slam`."""

__version__ = "0.1.0"
