"""Every format, made by a writer of others, is read with the same numbers, times and units."""

import hashlib

import numpy as np
import pytest
from foreign_files import BEGIN, MAKERS

from engine_mount.signals.formats.reading import headings, read
from engine_mount.signals.selection import select
from engine_mount.signals.signal import SignalError

N = 400
TIMES = np.arange(N) / 200.0
RANDOM = np.random.default_rng(7)
COLUMNS = {
    'az': ('m/s^2', RANDOM.standard_normal(N)),
    'travel': ('mm', 3.0 + RANDOM.standard_normal(N)),
}
DATED = ('blf', 'asc', 'candump', 'trc', 'mcap', 'db3_zstd')


@pytest.fixture(params=sorted(MAKERS))
def made(request, tmp_path):
    return request.param, MAKERS[request.param](tmp_path, 'drive', TIMES, COLUMNS)


def test_numbers_times_and_units_come_back(made):
    kind, file = made
    measured = read(file.path, [*file.names.values(), *filter(None, [file.time])], file.stated)
    for name, (unit, values) in COLUMNS.items():
        column = measured.column(file.names[name])
        np.testing.assert_allclose(column.values, values, rtol=1e-15 if kind == 'excel' else 0.0)  # 16 digits
        assert column.values.dtype == np.float64
        assert column.unit == (unit if file.units else '')
        times = measured.column(file.time).values if file.time else column.time.times
        np.testing.assert_allclose(times - times[0], TIMES, atol=2e-6)
        assert (column.time is None) == bool(file.time)
        if kind in DATED:
            assert abs(column.time.begin * 1e-9 + column.time.times[0] - BEGIN) < 0.01
    assert not [note for note in measured.notes if 'hold no number' in note]


def test_only_chosen_columns_are_read_and_the_provenance_tells_the_bytes(made):
    _, file = made
    measured = read(file.path, [file.names['travel']], file.stated)
    assert [one.values.size for one in measured.columns.values()] == [N]
    assert {one.name for one in headings(file.path, file.stated)} == {one.name for one in measured.headings}
    told = measured.provenance
    assert told.uri == str(file.path)
    files = (
        [file.path] if file.path.is_file() else sorted(one for one in file.path.rglob('*') if one.is_file())
    )
    hashes = [hashlib.sha256(one.read_bytes()).hexdigest() for one in files]
    whole = hashes[0]
    if file.path.is_dir():
        names = [one.relative_to(file.path).as_posix() for one in files]
        lines = ''.join(f'{each}  {name}\n' for each, name in zip(hashes, names, strict=True))
        whole = hashlib.sha256(lines.encode()).hexdigest()
    assert (told.sha256, told.size) == (whole, sum(one.stat().st_size for one in files))
    with pytest.raises(SignalError, match=r"has no column 'yaw'; its columns are .*"):
        read(file.path, ['yaw'], file.stated)


def test_signals_of_a_struct_have_the_times_of_the_nearest_one(tmp_path):
    from scipy.io import savemat

    structs = {
        name: {'time': TIMES * step, 'signals': {'values': COLUMNS['az'][1], 'label': 'x'}}
        for name, step in (('slow', 2.0), ('fast', 1.0))
    }
    savemat(tmp_path / 'out.mat', structs)
    for name, rate in (('slow', 100.0), ('fast', 200.0)):
        chosen = {'acceleration': f'{name}.signals.values:m/s^2'}
        signal = select(tmp_path / 'out.mat', chosen).signals['acceleration']
        assert signal.times[-1] == pytest.approx((N - 1) / rate)
