"""Why an initialisation is refused; every text says the value, the limit and what to do."""


class InitialisationError(ValueError):
    """The air gap was not estimated, so there is no current-force table."""


class CurrentNotFollowingError(InitialisationError):
    """The coil current does not follow its setpoint, for which late setpoints may be the reason."""
