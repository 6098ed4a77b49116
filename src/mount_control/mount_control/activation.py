"""Whether a current-force table belongs to this activation of the mount."""

from dataclasses import dataclass

from mount_control.force_to_current import ForceTableError

_STREAM_BREAK = 1_000_000_000  # ns, chosen: a longer silence may have been a loss of power


@dataclass
class MeasurementStream:
    """Knows since when the displacement has come without a break, by its stamps."""

    start: int | None = None
    last: int | None = None

    def note(self, stamp: int) -> None:
        """Take the stamp (ns) of a sample; one that comes a little too late changes nothing."""
        if self.last is None or abs(stamp - self.last) > _STREAM_BREAK:
            self.start = self.last = stamp
        elif stamp > self.last:
            self.last = stamp

    def holds(self, stamp: int) -> bool:
        """Whether the samples have come without a break from `stamp` (ns) until now."""
        return self.start is not None and self.last is not None and self.start <= stamp <= self.last


def check_belongs(table_stamp: int | None, air_gap_stamp: int | None, stream: MeasurementStream) -> None:
    """Raise `ForceTableError` unless the table was measured on the present uninterrupted measurement stream.

    Pads wear and the car is assembled anew, so a table from before a loss of power is not valid.
    """
    remedy = 'activate mount_init (again)'
    if table_stamp is None or air_gap_stamp is None:
        missing = 'current_force_table' if table_stamp is None else 'air_gap'
        raise ForceTableError(f'no {missing} was received; {remedy}')
    if table_stamp != air_gap_stamp:
        raise ForceTableError(
            f'current_force_table (activation {_seconds(table_stamp)}) and air_gap '
            f'(activation {_seconds(air_gap_stamp)}) are of different activations; {remedy}'
        )
    if stream.start is None or stream.last is None:
        raise ForceTableError('no displacement was received; activate mount_driver first')
    if table_stamp < stream.start:
        raise ForceTableError(
            f'current_force_table is of {_seconds(table_stamp)}, but the measurements restarted at '
            f'{_seconds(stream.start)}; {remedy}'
        )
    if table_stamp > stream.last:
        raise ForceTableError(
            f'current_force_table is of {_seconds(table_stamp)}, but the newest displacement is of '
            f'{_seconds(stream.last)}: the time of the measurements went back, or they stand still; {remedy}'
        )


def _seconds(stamp: int) -> str:
    return f'{stamp / 1e9:.3f} s'
