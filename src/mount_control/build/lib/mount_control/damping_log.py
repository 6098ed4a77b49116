"""What the log says of damping: when it went on and off, not more often than people read."""

_PERIOD = 1.0  # s, chosen: between two lines


class DampingLog:
    """Turns looks at the controller into lines of the log, apart from the thread that answers samples.

    What goes on and off between two looks is not seen; a recording tells each change.
    """

    def __init__(self) -> None:
        self._active = False  # at the last look
        self._began = 0.0  # time of the look that found damping on first, s
        self._changes = 0  # seen since the last line
        self._told_at = -_PERIOD

    def look(self, active: bool, now: float) -> str:
        """Return the line on what has changed until `now` (s, steady clock), empty where nothing has."""
        lasted = now - self._began
        if active != self._active:
            self._active, self._changes = active, self._changes + 1
            if active:
                self._began = now
        if not self._changes or now - self._told_at < _PERIOD:
            return ''
        changes, self._changes, self._told_at = self._changes, 0, now
        if changes > 1:
            return f'damping {"on" if active else "off"}, the last of {changes} changes'
        return 'damping on' if active else f'damping off after {lasted:.1f} s'
