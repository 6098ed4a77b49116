"""Class, unevenness and waviness of a road by ISO 8608.

The density Gd(n) of the height over the spatial frequency n is smoothed in octaves up to 0.0312 cycles/m, in
thirds of them up to 0.25, in twelfths above, and a line Gd(n0) (n / n0)^-w is fitted to it in logarithms from
0.011 to 2.83 cycles/m (ISO 8608:2016, 5.3 and annex). The class is that of Gd(n0) at n0 = 0.1 cycles/m.
"""

import math
from typing import NamedTuple

import numpy as np

from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.signal import FloatArray
from mount_sim.excitation.road import REFERENCE_FREQUENCY

CLASSES = 'ABCDEFGH'
FIRST_LIMIT = 32e-6  # m^3: between A and B; from class to class four times as much
FITTED = (0.011, 2.83)  # cycles/m
LONGEST_WAVE = 100.0
"""m, chosen: 0.33 Hz at 120 km/h, where wheel, body and engine move as one."""
_GAUSSIAN = math.sqrt(math.log(2.0) / 2.0) / math.pi
"""Standard deviation over the wavelength that is halved (ISO 16610-21)."""
_SMOOTHING = ((0.0312, 1), (0.25, 3), (math.inf, 12))  # up to cycles/m: bands to the octave
_LONGEST_SEGMENT = 256.0  # m, chosen: four averages over a kilometre, and a band below 0.011 cycles/m
_FEWEST_BANDS = 4
_LONG = 0.3  # cycles/m, chosen: a road's density has its maximum below
_CLIFF = 30.0  # chosen: no road falls so far below all that it was before, but a filter does
_FADED = 3  # bands, chosen: what a filter took before that


class RoadProfile(NamedTuple):
    """Heights (n,) in m at places `spacing` m apart from `first` m on, under one track of wheels.

    `effective`: the heights are those that the axle feels, after the tyre has rounded the road. `notes` are
    sentences that say what was done to the file to get them.
    """

    first: float
    spacing: float
    height: FloatArray
    provenance: Provenance
    notes: tuple[str, ...] = ()
    effective: bool = False

    @property
    def distance(self) -> FloatArray:
        """Places (n,) in m."""
        return self.first + self.spacing * np.arange(self.height.size, dtype=np.float64)

    @property
    def length(self) -> float:
        """From the first place to the last, m."""
        return (self.height.size - 1) * self.spacing

    @property
    def name(self) -> str:
        """The file's name, for sentences."""
        return self.provenance.uri.rpartition('/')[2]


def without_long_waves(height: FloatArray, spacing: float) -> FloatArray:
    """Return heights (n,) in m, `spacing` m apart, without their line and waves of more than `LONGEST_WAVE`.

    A wave of that length is halved; one of a third of it is left within 1 %.
    """
    from scipy.ndimage import gaussian_filter1d

    places = np.arange(height.size) - 0.5 * (height.size - 1)
    slope = (places @ height) / (places @ places)
    level = height - height.mean() - slope * places
    return np.asarray(level - gaussian_filter1d(level, _GAUSSIAN * LONGEST_WAVE / spacing, mode='mirror'))


def root_mean_square(profile: RoadProfile) -> float:
    """Return the root of the mean square (m) of heights without long waves."""
    return float(np.sqrt(np.mean(without_long_waves(profile.height, profile.spacing) ** 2)))


class Unevenness(NamedTuple):
    """Gd(n0) (m^3), waviness, class, and what they were taken from: bands (n,) in cycles/m, densities in m^3.

    `lowest` and `highest` (cycles/m) bound the fit; `beyond` tells that n0 lies outside.
    """

    roughness: float
    waviness: float
    letter: str
    frequency: FloatArray
    density: FloatArray
    lowest: float
    highest: float

    @property
    def beyond(self) -> bool:
        """Whether n0 is outside of the bands, so that Gd(n0) continues the line."""
        return not self.lowest <= REFERENCE_FREQUENCY <= self.highest

    def sentences(self) -> tuple[str, ...]:
        """Return what is to be told beside a road, one sentence a line."""
        found = (
            f'ISO 8608 class {self.letter}: Gd(0.1 cycles/m) {1e6 * self.roughness:.3g}e-6 m^3, waviness '
            f'{self.waviness:.2f}, from {self.lowest:.3g} to {self.highest:.3g} cycles/m'
        )
        guess = 'too short or too coarse for 0.1 cycles/m: the class continues the line and is a guess'
        return (found, guess) if self.beyond else (found,)


def unevenness(profile: RoadProfile) -> Unevenness:
    """Return class, roughness and waviness of a road."""
    frequency, smoothed = _smoothed(*_density(profile))
    lowest, highest = _held(frequency, smoothed)
    used = (frequency >= max(FITTED[0], lowest)) & (frequency <= min(FITTED[1], highest))
    if np.count_nonzero(used) < _FEWEST_BANDS:
        used = np.ones(frequency.size, bool)
    slope, level = np.polyfit(np.log(frequency[used] / REFERENCE_FREQUENCY), np.log(smoothed[used]), 1)
    roughness = float(np.exp(level))
    first, last = map(float, frequency[used][[0, -1]])
    return Unevenness(roughness, -float(slope), class_of(roughness), frequency, smoothed, first, last)


def _held(frequency: FloatArray, density: FloatArray) -> tuple[float, float]:
    """Return the band that a road holds: filters, and inversion, leave nothing below or above."""
    long = max(int(np.count_nonzero(frequency <= _LONG)), 1)
    first = int(np.argmax(density[:long]))
    before = np.minimum.accumulate(density[first:])[:-1]
    behind = np.maximum.accumulate(density[:first:-1])[::-1]
    cliffs = np.flatnonzero(behind * _CLIFF < before)
    last = first + int(cliffs[0]) - _FADED if cliffs.size else frequency.size - 1
    return float(frequency[first]), float(frequency[max(last, first)])


def class_of(roughness: float) -> str:
    """Return the class of a Gd(n0) in m^3."""
    number = math.ceil(math.log(roughness / FIRST_LIMIT, 4.0))
    return CLASSES[min(max(number, 0), len(CLASSES) - 1)]


def _density(profile: RoadProfile) -> tuple[FloatArray, FloatArray]:
    """Return spatial frequencies (cycles/m) above 0 and one-sided densities (m^3) of heights."""
    from scipy.signal import welch

    segment = min(profile.length, _LONGEST_SEGMENT)
    count = min(profile.height.size, max(round(segment / profile.spacing), 16))
    frequency, density = welch(profile.height, 1.0 / profile.spacing, 'hann', count, detrend='linear')
    return frequency[1:], np.maximum(density[1:], np.finfo(float).tiny)


def _smoothed(frequency: FloatArray, density: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the centres of the bands and the mean densities in them; empty bands are left out."""
    centres, means = [], []
    lower = frequency[0]
    while lower < frequency[-1]:
        parts = next(parts for limit, parts in _SMOOTHING if lower < limit)
        upper = lower * 2.0 ** (1.0 / parts)
        inside = (frequency >= lower) & (frequency < upper)
        if inside.any():
            centres.append(math.sqrt(lower * upper) if np.count_nonzero(inside) > 1 else frequency[inside][0])
            means.append(density[inside].mean())
        lower = upper
    return np.array(centres), np.array(means)
