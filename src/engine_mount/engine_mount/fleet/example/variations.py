"""What the recordings of the example fleet are: ten drives, each in twenty variations.

All values are chosen.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

Settings = Mapping[str, Any]

SWITCHED = {'policy': 'switched_viscous'}
"""The paper's policy; a drive that names none has the default."""


@dataclass(frozen=True)
class Drive:
    """A drive: parameters of `mount_sim` and of `mount_control`."""

    name: str
    sim: Settings
    control: Settings = field(default_factory=dict)


@dataclass(frozen=True)
class Variation:
    """What is different from the plain drive; `cut` is the piece that is kept, s from the first sample.

    `control` is of the default policy, `switched` of the paper's; with `own_control` the drive's own
    parameters of `mount_control` are left out. `sample_rate` in Hz.
    """

    name: str
    sim: Settings = field(default_factory=dict)
    control: Settings = field(default_factory=dict)
    switched: Settings = field(default_factory=dict)
    own_control: bool = False
    cut: tuple[float | None, float | None] | None = None
    sample_rate: float | None = None


def _motorway(speed: float, roughness: float, gap: float) -> dict[str, Any]:
    return {
        'scenario': 'motorway',
        'motorway.speed': speed,
        'motorway.roughness': roughness,
        'motorway.gap_depth': gap,
    }


DRIVES = (
    Drive('motorway', _motorway(33.0, 2e-6, 0.020)),
    Drive('country_road', _motorway(22.0, 8e-6, 0.030)),
    Drive('deep_gap', _motorway(45.0, 2e-6, 0.040)),
    Drive('smooth_road', _motorway(33.0, 1e-6, 0.0)),
    Drive('motorway_switched', _motorway(33.0, 4e-6, 0.025), SWITCHED),
    Drive('tip_in', {**_motorway(12.0, 4e-6, 0.0), 'tip_in.force': 600.0, 'idle.amplitude': 60.0}),
    Drive('bench_8_hz', {'scenario': 'bench'}),
    Drive('bench_11_hz', {'scenario': 'bench', 'bench.frequency': 11.0, 'bench.amplitude': 0.0012}, SWITCHED),
    Drive('sweep', {'scenario': 'sweep', 'sweep.first_frequency': 5.0, 'sweep.rate': 2.5}),
    Drive(
        'sweep_switched',
        {
            'scenario': 'sweep',
            'sweep.first_frequency': 4.0,
            'sweep.rate': 3.0,
            'sweep.velocity_amplitude': 0.16,
        },
        {**SWITCHED, 'damper': 'degressive'},
    ),
)

VARIATIONS = (
    Variation('plain'),
    Variation('second_seed', {'seed': 2}),
    Variation('third_seed', {'seed': 3}),
    Variation('warm_coil', {'electronics.coil_temperature': 60.0}),
    Variation('hot_coil', {'electronics.coil_temperature': 95.0}),
    Variation('worn_pads', {'friction.scale': 0.85}),
    Variation('new_pads', {'friction.scale': 1.15}),
    Variation('soft', {}, {'continuous_viscous.damping_coefficient': 1800.0}, {'switch_off_level': 0.0005}),
    Variation('stiff', {}, {'continuous_viscous.damping_coefficient': 3200.0}, {'switch_off_level': 0.0002}),
    Variation('early', {}, {'continuous_viscous.full_amplitude': 0.0003}, {'switch_on_level': 0.0006}),
    Variation('late', {}, {'continuous_viscous.full_amplitude': 0.0007}, {'switch_on_level': 0.0011}),
    Variation('undamped', {'mount': 'friction_off'}),
    Variation('always_on', {'mount': 'friction_always_on'}, own_control=True),
    Variation('hydromount', {'mount': 'hydro'}),
    Variation('elastomer', {'mount': 'elastomer'}),
    Variation('two_mounts', {'mounts': 'left,right'}),
    Variation('without_ramp', cut=(3.6, None)),
    Variation('without_end', cut=(None, 5.5)),
    Variation('middle', cut=(4.0, 6.5)),
    Variation('half_rate', sample_rate=500.0),
)
