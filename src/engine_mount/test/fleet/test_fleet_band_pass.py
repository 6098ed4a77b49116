"""The band-pass of the catalogue is that of scipy, which its workers need not load."""

import numpy as np
import pytest
from scipy import signal

from engine_mount.fleet.catalogue.band_pass import BandPass, sections
from engine_mount.fleet.catalogue.columns import BANDS


@pytest.mark.parametrize('rate', [125.0, 500.0, 1000.0, 2000.0])
@pytest.mark.parametrize('band', BANDS)
def test_sections_and_what_passes_are_those_of_scipy(band, rate):
    expected = signal.butter(4, band, 'bandpass', fs=rate, output='sos')
    np.testing.assert_allclose(np.insert(sections(band, rate), 3, 1.0, axis=1), expected, rtol=1e-12)
    values = np.random.default_rng(1).normal(size=3000)
    found = BandPass(band, rate)
    passed = np.concatenate([found.passed(values[:1001]), found.passed(values[1001:])])
    np.testing.assert_allclose(passed, signal.sosfilt(expected, values), rtol=1e-6, atol=1e-12)


def test_a_band_beyond_half_the_rate_is_refused():
    with pytest.raises(ValueError, match='half the rate, 50 Hz'):
        BandPass((30.0, 50.0), 100.0)
