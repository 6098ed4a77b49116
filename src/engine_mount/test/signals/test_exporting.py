"""Signals of a recording as a table that other programs and the import read."""

import numpy as np
import pytest

import engine_mount
from engine_mount.signals.exporting import export
from engine_mount.signals.formats.reading import read

START = {'mount_sim': {'timeline.start': 2.8}}


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    out = tmp_path_factory.mktemp('drive') / 'run'
    return engine_mount.drive(core=True, scenario='bench', duration=0.6, parameters=START, out=out).recording


@pytest.mark.parametrize(
    ('ending', 'column'),
    [('csv', 'displacement.mount'), ('parquet', 'displacement.mount'), ('mat', 'displacement_mount.data')],
)
def test_an_exported_displacement_is_imported_as_it_was(recording, tmp_path, ending, column):
    file = tmp_path / f'a.{ending}'
    export(recording, file)
    assert read(file, [column]).columns[column].unit == 'm'
    done = engine_mount.import_file(file, tmp_path / 'b', columns=[f'displacement={column}'])
    before, after = (
        engine_mount.open(place)['displacement']['mount'] for place in (recording, *done.recordings)
    )
    np.testing.assert_allclose(after, before - before.mean(), atol=1e-12)


def test_other_topics_hold_their_last_value_at_the_samples_of_the_displacement(recording, tmp_path):
    export(recording, tmp_path / 'a.parquet')
    table, opened = read(tmp_path / 'a.parquet').columns, engine_mount.open(recording)
    rows, trace = opened['displacement'].stamps, opened['control_trace']
    current = table['control_trace.current'].values
    traced = np.isin(rows, trace.stamps)
    assert np.isnan(current[: int(np.argmax(traced))]).all()
    np.testing.assert_array_equal(current[traced], trace['current'])
    last = np.searchsorted(opened['coil_temperature'].stamps, rows, side='right') - 1
    held = table['coil_temperature.temperature'].values
    np.testing.assert_array_equal(held, opened['coil_temperature']['temperature'][last])


def test_chosen_signals_stand_at_their_own_samples(recording, tmp_path):
    names = ['control_trace.current', 'coil_temperature.temperature']
    count = len(engine_mount.open(recording)['control_trace'])
    assert f'2 signals, {count} rows' in export(recording, tmp_path / 'a.csv', names)
