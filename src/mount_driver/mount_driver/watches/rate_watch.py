"""Whether the electronics measure at the rate for which the graph was made, by their own counters.

No bus and no clock here. Counter and microseconds come in the same frame, so neither load nor lost frames of
this machine alter what is seen.
"""

from mount_driver.codec import Measurement
from mount_models.sampling import sample_time_ns

_COUNTER_MASK = 0xFFFF
_MICROSECOND_MASK = 0xFFFF_FFFF
_FARTHEST = 8  # samples, chosen: over more the counters may have begun anew
_TOLERANCE = 0.2  # chosen: of the period; less than any other rate lies beside, more than a sample jitters
_IN_A_ROW = 10  # chosen: 5 to 20 ms


class RateWatch:
    """Takes the counters of new samples, one by one; `sample_rate` in Hz."""

    def __init__(self, sample_rate: float):
        self._rate = sample_rate
        self._period = sample_time_ns(sample_rate) // 1000  # us
        self._slack = round(_TOLERANCE * self._period)  # us
        self._counter = 0
        self._microseconds = 0
        self._wrong = 0  # steps in a row

    def judge(self, sample: Measurement) -> str:
        """Return why the electronics do not fit the graph, empty while they do or that is not certain."""
        samples = (sample.sample_counter - self._counter) & _COUNTER_MASK
        elapsed = (sample.microseconds - self._microseconds) & _MICROSECOND_MASK
        self._counter, self._microseconds = sample.sample_counter, sample.microseconds
        if abs(elapsed - samples * self._period) <= samples * self._slack:
            self._wrong = 0
            return ''
        if not 0 < samples <= _FARTHEST:
            return ''
        self._wrong += 1
        return self._sentence(samples, elapsed) if self._wrong >= _IN_A_ROW else ''

    def _sentence(self, samples: int, elapsed: int) -> str:
        return (
            f'the electronics sample every {elapsed / samples:.0f} us, but sample_rate ({self._rate:g} Hz) '
            f'means {self._period} us (limit {self._slack} us beside it): start the whole graph with the '
            'sample_rate of the electronics'
        )
