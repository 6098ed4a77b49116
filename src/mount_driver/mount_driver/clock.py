"""From the microsecond counter of the electronics to time stamps.

`ElectronicsClock` is for real time, `CounterClock` for lock-step.
"""

from math import inf

from mount_models.sampling import SAMPLE_TIME_NS

_WRAP = 1 << 32  # us: the counter wraps after 71.6 min
_NS = 1000  # ns per us

_GAP_US = 1_000_000  # chosen: after a second without samples a new mapping is started
_BLOCK_US = 500_000  # chosen: 250 samples or more, of which at least one usually arrives without delay

# Second-order loop per block: share of the error corrected in the next block, and share that goes to the
# estimated drift. Poles at 0.75 +- 0.19j: it settles in about 10 blocks without ringing. Chosen.
_PHASE_GAIN = 0.5
_DRIFT_GAIN = 0.1
_DRIFT_LIMIT = 500e-6  # chosen: more than twice the +-200 ppm of a usable quartz
_SLEW_LIMIT = 1000e-6  # chosen: samples 1 ms apart get stamps within 1 us of that
_FAST_SLEW_LIMIT = 0.1  # chosen: for stamps that lie far in the future
_TRUSTED_NS = 5_000_000  # ns, chosen: of a block without any frame in time the clock is not corrected
_BLOCKS_TO_BELIEVE = 8  # chosen: 4 s in which every frame is late are no pause but an error of the mapping


class CounterClock:
    """Stamps are the electronics' own counter from zero, unwrapped: for lock-step, where no other time is."""

    lockstep = True
    """Whether ages are judged by the stamps."""

    def __init__(self, sample_time: int = SAMPLE_TIME_NS) -> None:
        """`sample_time` in ns."""
        self.restarts = 0
        self.gaps = 0
        self._sample_time = sample_time
        self._microseconds = 0
        self._base = 0
        self._stamp = -1

    def stamp(self, microseconds: int, received_monotonic_ns: int = 0) -> int:
        """Return the time of the sample in ns; after a restart stamps go on a sample behind the last."""
        step = (microseconds - self._microseconds) % _WRAP
        if self._stamp < 0:
            self._base = 0
        elif step >= _WRAP // 2:
            self.restarts += 1
            self._base = self._stamp + self._sample_time - microseconds * _NS
        elif microseconds < self._microseconds:
            self._base += _WRAP * _NS
        self._microseconds = microseconds
        self._stamp = self._base + microseconds * _NS
        return self._stamp

    def now(self, monotonic_ns: int) -> int:
        """Return the latest stamp, 0 before the first."""
        return max(self._stamp, 0)


class ElectronicsClock:
    """Maps the counter to ROS time: offset and drift from the frames that arrived fastest.

    A frame is never early, only late, so the least of (time of reception - time of sample) over a block
    of samples is the offset between the clocks. Within a block the mapping is one straight line; from
    block to block only its slope changes, by no more than 1000 ppm, so stamps are evenly spaced and rise
    strictly. `epoch_offset_ns` (ROS time minus steady clock, taken once) is the only tie to the system's
    clock, whose steps therefore do not move the stamps. `sample_time` is in ns.

    A new mapping begins when the counter jumps back (restart) or forward by more than a second (gap), and
    when all frames have come late for 4 s. It never leads back behind the last stamp. Frames must come in
    the order of their samples.
    """

    lockstep = False

    def __init__(self, epoch_offset_ns: int, sample_time: int = SAMPLE_TIME_NS):
        self.restarts = 0
        """Jumps of the counter that time does not explain."""
        self.gaps = 0
        """Pauses of more than a second."""
        self.remappings = 0
        """Mappings begun anew because all frames were late for 4 s."""
        self.drift = 0.0
        """Estimated drift of the steady clock against the electronics' clock, 1e-6 = 1 ppm."""
        self._epoch_offset = epoch_offset_ns
        self._sample_time = sample_time
        self._running = False
        self._microseconds = 0
        self._received = 0
        self._stamp = 0
        self._elapsed = 0  # us since the beginning of the block
        self._base = 0  # stamp at the beginning of the block
        self._correction = 0.0  # of the slope in this block, beside the drift
        self._slope = 0.0  # ns per us beyond 1000
        self._earliest = 0.0  # ns, least lateness in the block, as it were without the correction
        self._late_blocks = 0

    def stamp(self, microseconds: int, received_monotonic_ns: int) -> int:
        """Return the ROS time (ns) of the sample taken at `microseconds` and received at the steady time."""
        step = (microseconds - self._microseconds) % _WRAP
        arrival = received_monotonic_ns + self._epoch_offset
        if not self._running or step > _GAP_US:
            if self._running:
                waited = (received_monotonic_ns - self._received) // _NS
                if abs(step - waited % _WRAP) <= _GAP_US:
                    self.gaps += 1
                else:
                    self.restarts += 1
            self._begin(arrival)
        elif step:
            self._elapsed += step
            self._stamp = self._base + self._elapsed * _NS + round(self._elapsed * self._slope)
            lateness = arrival - self._stamp + self._elapsed * self._correction * _NS
            if lateness < self._earliest:
                self._earliest = lateness
            if self._elapsed >= _BLOCK_US:
                self._end_block()
        self._microseconds = microseconds
        self._received = received_monotonic_ns
        return self._stamp

    def now(self, monotonic_ns: int) -> int:
        """Return the steady time itself."""
        return monotonic_ns

    def _begin(self, arrival: int) -> None:
        self._stamp = max(arrival, self._stamp + self._sample_time) if self._running else arrival
        self._running = True
        self._late_blocks = 0
        self._begin_block(0.0)

    def _begin_block(self, correction: float) -> None:
        self._correction = correction
        self._slope = (self.drift + correction) * _NS
        self._base = self._stamp
        self._elapsed = 0
        self._earliest = inf

    def _end_block(self) -> None:
        earliest = self._earliest - self._elapsed * self._correction * _NS  # what is left of it now
        error = earliest / (_BLOCK_US * _NS)  # as a slope over the next block
        correction = 0.0
        if earliest > _TRUSTED_NS:
            self._late_blocks += 1
            if self._late_blocks >= _BLOCKS_TO_BELIEVE:
                self.remappings += 1
                self._stamp += round(earliest)
                self._late_blocks = 0
        elif earliest < -_TRUSTED_NS:
            # Certain, because no frame is early: the first frame of the mapping was late.
            self._late_blocks = 0
            correction = max(_PHASE_GAIN * error, -_FAST_SLEW_LIMIT)
        else:
            self._late_blocks = 0
            drift = self.drift + _DRIFT_GAIN * error
            self.drift = min(max(drift, -_DRIFT_LIMIT), _DRIFT_LIMIT)
            limit = _SLEW_LIMIT - abs(self.drift)
            correction = min(max(_PHASE_GAIN * error, -limit), limit)
        self._begin_block(correction)


Clock = CounterClock | ElectronicsClock
"""Gives samples their stamps and counts what interrupted the electronics' counter."""
