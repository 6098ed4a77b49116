"""Class and waviness of roads of known density."""

import numpy as np
import pytest

from engine_mount.signals.roads.iso8608 import class_of, unevenness


@pytest.mark.parametrize(
    ('roughness', 'waviness', 'letter'),
    [(2e-6, 2.0, 'A'), (64e-6, 1.6, 'B'), (64e-6, 2.6, 'B'), (256e-6, 2.0, 'C'), (16384e-6, 2.0, 'F')],
)
def test_known_density_and_waviness_come_back(made_road, roughness, waviness, letter):
    found = unevenness(made_road(roughness, waviness, length=1500.0, seed=5))
    assert found.roughness == pytest.approx(roughness, rel=0.15)
    assert found.waviness == pytest.approx(waviness, abs=0.06)
    assert (found.letter, found.beyond) == (letter, False)
    assert f'class {letter}' in found.sentences()[0]


def test_the_limits_between_classes_are_those_of_the_standard():
    limits = 32e-6 * 4.0 ** np.arange(7)
    assert [class_of(0.999 * limit) for limit in limits] == list('ABCDEFG')
    assert [class_of(1.001 * limit) for limit in limits] == list('BCDEFGH')
    assert (class_of(1e-7), class_of(10.0)) == ('A', 'H')


def test_of_a_short_road_the_class_is_called_a_guess(made_road):
    found = unevenness(made_road(length=8.0, spacing=0.01))
    assert found.beyond
    assert 'a guess' in found.sentences()[1]


def test_of_a_road_cut_to_a_band_the_class_is_that_of_the_band(made_road):
    whole = made_road(64e-6, length=600.0, spacing=0.02, seed=7)
    spectrum, frequency = np.fft.rfft(whole.height), np.fft.rfftfreq(whole.height.size, whole.spacing)
    held = np.clip(frequency / 0.05 - 3.0, 0.0, 1.0) * np.clip(5.0 * (1.0 - frequency / 2.0), 0.0, 1.0)
    found = unevenness(whole._replace(height=np.round(np.fft.irfft(spectrum * held, whole.height.size), 7)))
    assert found.roughness == pytest.approx(64e-6, rel=0.4)
    assert found.waviness == pytest.approx(2.0, abs=0.25)
    assert found.beyond  # the band begins at 0.2 cycles/m
    assert found.highest < 2.0
