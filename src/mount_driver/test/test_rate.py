"""Electronics that measure at another rate than the graph was made for are refused."""

import pytest
from far_end import CODEC, sample

from mount_driver.clock import CounterClock
from mount_driver.link import Link
from mount_models.sampling import sample_time_ns

REFUSED = (
    'the electronics sample every {} us, but sample_rate ({} Hz) means {} us (limit {} us beside it): '
    'start the whole graph with the sample_rate of the electronics'
)


def first_doubt(rate, period, counters, jitter=lambda k: 0, start=0):
    """Return (place, sentence) of the first doubt in samples of these counters, `period` us apart."""
    link = Link(CODEC, CounterClock(), sample_time_ns(rate))
    for place, k in enumerate(counters):
        microseconds = (start + k * period + jitter(k)) % 2**32
        taken = sample(0)._replace(sample_counter=k % 65536, microseconds=microseconds)
        assert link.take(CODEC.encode_measurement(taken, place & 0xFF), 0) is not None
        if link.rate_objection:
            return place, link.rate_objection
    return None


@pytest.mark.parametrize(
    ('rate', 'period', 'limit'), [(1000.0, 500, 200), (2000.0, 1000, 100), (500.0, 1000, 400)]
)
def test_another_rate_is_refused_after_ten_samples(rate, period, limit):
    place, sentence = first_doubt(rate, period, range(7, 100))
    assert place <= 11
    assert sentence == REFUSED.format(period, f'{rate:g}', round(1e6 / rate), limit)


@pytest.mark.parametrize('rate', [500.0, 625.0, 1000.0, 2000.0])
def test_the_right_rate_is_never_doubted(rate):
    period = round(1e6 / rate)

    def jitter(k):
        return (k % 3 - 1) * period // 12

    whole = range(65_000, 66_500)  # the counter wraps within
    lossy = [k for k in whole if k % 7 and not 65_700 < k < 65_900]
    for counters in (whole, lossy):
        assert first_doubt(rate, period, counters, jitter, start=2**32 - 70_000 * period) is None


def test_a_restart_of_the_electronics_is_no_other_rate():
    assert first_doubt(1000.0, 1000, [*range(300, 350), *range(103, 120), *range(1000, 1030)]) is None
