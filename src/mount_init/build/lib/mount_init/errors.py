"""Why an initialisation is refused; every text says the value, the limit and what to do."""


class InitialisationError(ValueError):
    """The air gap was not estimated, so there is no current-force table."""


class TooFewRipplesError(InitialisationError):
    """Not enough valid ripple samples arrived."""


class CurrentNotFollowingError(InitialisationError):
    """The coil current does not follow its setpoint."""


class OverloadError(InitialisationError):
    """Setpoints came too late for the safe state to let the coil be driven."""


class UnusableReadingsError(InitialisationError):
    """The ripple readings cannot be those of a working coil: wrong sign, stuck, or scattered."""


class AmbiguousCurveError(InitialisationError):
    """The inductance does not fall through the crossing exactly once and monotonically."""


class OutsideCalibrationError(InitialisationError):
    """A gap estimate lies where the specimen was never calibrated."""


class WrongCoilError(InitialisationError):
    """The resistance of the coil is not that of the specimen."""


class SupplyError(InitialisationError):
    """The supply lies where the gap curves do not hold, or does not drive the ramp."""


class NoContactError(InitialisationError):
    """The pads never came into contact, or never left it."""


class ContradictionError(InitialisationError):
    """Two estimates of the same thing disagree by more than their scatter allows."""


class ImpreciseError(InitialisationError):
    """The standard deviation of an estimate is too large."""


class SpecimenMismatchError(InitialisationError):
    """The parameters of the ramp do not fit the specimen."""


class DriverRefusalError(InitialisationError):
    """The driver keeps the coil at 0 A, so no ramp reaches it."""


class CoilBusyError(InitialisationError):
    """Another node sends setpoints to the coil."""
