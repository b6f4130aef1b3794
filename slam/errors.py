"""The errors of the algorithm: degenerate input and unknown names, refused before a wrong number comes out."""


class SlamError(ValueError):
    """Input or configuration that the pipeline refuses by name."""
