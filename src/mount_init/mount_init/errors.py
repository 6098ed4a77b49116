"""Why an initialisation is refused; every text says the value, the limit and what to do."""


class InitialisationError(ValueError):
    """The air gap was not estimated, so there is no current-force table."""
