"""A recorded drive under all three mounts: made up, and the real one where it lies."""

import json

import numpy as np
import pytest

from engine_mount.experiments import recorded_drive
from engine_mount.experiments.harness.experiment import ExperimentError
from engine_mount.experiments.recorded_drive import (
    ELASTOMER,
    FRICTION,
    HYDRO,
)
from engine_mount.experiments.registry import experiment
from engine_mount.signals.sources.uris import SourceError

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def driven(tmp_path_factory):
    # 20 Hz all the time; from 6 to 7 s the engine's eigenfrequency
    folder = tmp_path_factory.mktemp('drive')
    times = np.arange(0.0, 14.0, 0.005)
    burst = 2.0 * np.sin(2 * np.pi * 7.5 * times) * ((times >= 6.0) & (times < 7.0))
    down = -0.5 * (0.3 * np.sin(2 * np.pi * 20.0 * times) + burst)
    np.savetxt(
        folder / 'drive.csv', np.column_stack([times, down]), delimiter=',', header='t,az', comments=''
    )
    return experiment(
        recorded_drive.NAME, out=folder / 'out', file=str(folder / 'drive.csv'), column='az', scale=-2.0
    )


def test_it_writes_recordings_pictures_plain_figures_and_a_page_without_places(driven):
    json.dumps(driven.figures, allow_nan=False)
    assert len(driven.recordings) == 3
    assert all(picture.read_bytes().startswith(b'\x89PNG') for picture in driven.pictures)
    text = driven.pages[0].read_text()
    assert 'Driven: `drive.csv`, `az`, times -2, 14.0 s at 200 samples per second' in text
    assert str(driven.pages[0].parent) not in text
    for picture in driven.pictures:
        assert f'(figures/{picture.name})' in text


def test_the_chassis_moves_as_recorded_and_damping_works_in_the_burst_alone(driven):
    low, middle, high = driven.figures['acceleration_band_rms_m_s2']
    assert high == pytest.approx(0.3 / np.sqrt(2), rel=0.03)
    assert middle == pytest.approx(2.0 / np.sqrt(2) * np.sqrt(1.0 / 14.0), rel=0.05)
    assert low < 0.2 * middle
    assert 6.1 < driven.figures['switched_on_s'][0] < 6.6
    runs = driven.figures['runs']
    in_burst = {name: each['displacement_band_rms_at_events_m'][1] for name, each in runs.items()}
    assert in_burst[FRICTION] < 0.7 * in_burst[ELASTOMER]
    forces = {name: each['force_band_rms_else_n'][2] for name, each in runs.items()}
    assert forces[FRICTION] == pytest.approx(forces[ELASTOMER], rel=0.02)  # swinging out
    assert forces[HYDRO] > 1.1 * forces[ELASTOMER]


def test_what_cannot_be_driven_is_refused_before_anything_is_made(tmp_path):
    out, file = tmp_path / 'out', str(tmp_path / 'none.csv')
    with pytest.raises(ExperimentError, match=r'needs a recorded vertical .* --set recorded_drive\.file='):
        experiment(recorded_drive.NAME, out=out, file='')
    with pytest.raises(SourceError, match='no such file'):
        experiment(recorded_drive.NAME, out=out, file=file)
    assert not out.exists()
