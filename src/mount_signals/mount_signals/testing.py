"""Files of measured signals in every format that is read, each by a writer that is not of this project.

`MAKERS` is {format: function(folder, name, times, columns) -> Made}: `times` (n,) in s, `columns`
{name: (unit, values (n,))}. Names of columns should be plain words.
"""

import csv
import json
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mount_signals.formats.content import Stated
from mount_signals.formats.measured import FloatArray

Columns = Mapping[str, tuple[str, FloatArray]]
BEGIN = 1_700_000_000  # s since 1970, of formats that tell a date


@dataclass(frozen=True)
class Made:
    """A file: where it is, what must be stated, how each column is called, and that of times ('': none)."""

    path: Path
    names: Mapping[str, str]
    time: str = ''
    stated: Stated = field(default_factory=Stated)
    units: bool = True


Maker = Callable[[Path, str, FloatArray, Columns], Made]


def make_csv(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a CSV file with units in brackets."""
    return _table(folder / f'{name}.csv', times, columns, ',', '.')


def make_german_csv(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a table with semicolons, decimal commas, and lines before the titles."""
    return _table(folder / f'{name}.csv', times, columns, ';', ',', ('Messung;12', 'Bediener;Meier', ''))


def make_text(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write blanks between the cells, by numpy, without titles or times."""
    path = folder / f'{name}.txt'
    np.savetxt(path, np.column_stack([values for _, values in columns.values()]), fmt='%25.17g')
    return _untitled(path, times, columns)


def make_npy(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write two NPY files that belong together."""
    np.save(folder / f'{name}_t.npy', times)
    np.save(folder / f'{name}_value.npy', np.column_stack([values for _, values in columns.values()]))
    names = {key: str(place) for place, key in enumerate(columns)}
    return Made(folder / f'{name}_value.npy', names, units=False)


def make_comma2k19(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write the layout of comma2k19: NPY files `t` and `value` without a suffix."""
    place = folder / name / 'processed_log' / 'IMU' / 'accelerometer'
    place.mkdir(parents=True)
    for file, array in (('t', times), ('value', np.column_stack([one for _, one in columns.values()]))):
        with (place / file).open('wb') as stream:
            np.save(stream, array)
    return Made(place, {key: str(number) for number, key in enumerate(columns)}, units=False)


def make_npz(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write an NPZ file with a named array for each column."""
    path = folder / f'{name}.npz'
    np.savez_compressed(path, t=times, **{key: values for key, (_, values) in columns.items()})
    return Made(path, {key: key for key in columns}, 't', units=False)


def make_json(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a JSON file of nested lists."""
    path = folder / f'{name}.json'
    data = {key: {'unit': unit, 'values': values.tolist()} for key, (unit, values) in columns.items()}
    path.write_text(json.dumps({'meta': {'car': 'x'}, 'signals': {'t': times.tolist(), **data}}))
    return Made(path, {key: f'{key}.values' for key in columns}, 't')


def make_parquet(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a Parquet file with units in the metadata of its columns."""
    import pyarrow
    from pyarrow import parquet

    fields = [pyarrow.field('t', pyarrow.float64(), metadata={'unit': 's'})]
    fields += [
        pyarrow.field(key, pyarrow.float64(), metadata={'unit': unit}) for key, (unit, _) in columns.items()
    ]
    arrays = [times, *(values for _, values in columns.values())]
    path = folder / f'{name}.parquet'
    parquet.write_table(pyarrow.table(arrays, schema=pyarrow.schema(fields)), path)
    return Made(path, {key: key for key in columns}, 't')


def make_matlab(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a MATLAB 5 file with a struct of columns."""
    from scipy.io import savemat

    path = folder / f'{name}.mat'
    savemat(path, {'rec': {'t': times, **{key: values for key, (_, values) in columns.items()}}})
    return Made(path, {key: key for key in columns}, 't', units=False)


def make_matlab_73(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write what MATLAB 7.3 writes: HDF5 behind a block of 512 bytes, with rows and columns exchanged."""
    import h5py

    path = folder / f'{name}.mat'
    with h5py.File(path, 'w', userblock_size=512) as file:
        group = file.create_group('rec')
        group.attrs['MATLAB_class'] = np.bytes_('struct')
        for key, values in {'t': times, **{key: one for key, (_, one) in columns.items()}}.items():
            group.create_dataset(key, data=values[None, :]).attrs['MATLAB_class'] = np.bytes_('double')
    head = b'MATLAB 7.3 MAT-file, Platform: GLNXA64'.ljust(124) + struct.pack('<H', 0x0200) + b'IM'
    with path.open('r+b') as stream:
        stream.write(head.ljust(512, b'\0'))
    return Made(path, {key: key for key in columns}, 't', units=False)


def make_hdf5(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write an HDF5 file with units as attributes."""
    import h5py

    path = folder / f'{name}.h5'
    with h5py.File(path, 'w') as file:
        for key, (unit, values) in {'t': ('s', times), **columns}.items():
            file.create_dataset(f'rec/{key}', data=values, chunks=True, compression='gzip').attrs['unit'] = (
                unit
            )
    return Made(path, {key: key for key in columns}, 't')


def make_excel(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a workbook with units below the titles and a sheet of remarks."""
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = 'Messung'
    sheet.append(['t', *columns])
    sheet.append(['s', *(unit for unit, _ in columns.values())])
    for row in np.column_stack([times, *(values for _, values in columns.values())]).tolist():
        sheet.append(row)
    book.create_sheet('Bemerkungen').append(['keine'])
    path = folder / f'{name}.xlsx'
    book.save(path)
    return Made(path, {key: key for key in columns}, 't')


def make_mdf(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write an MDF 4 file."""
    return _mdf(folder / f'{name}.mf4', '4.10', times, columns)


def make_mdf3(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write an MDF 3 file."""
    return _mdf(folder / f'{name}.mdf', '3.30', times, columns)


def make_blf(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a log of CAN FD frames as BLF."""
    return _can_log(folder / f'{name}.blf', times, columns)


def make_asc(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a log of CAN FD frames as ASC."""
    return _can_log(folder / f'{name}.asc', times, columns)


def make_candump(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a log of CAN FD frames as candump does."""
    return _can_log(folder / f'{name}.log', times, columns)


def make_trc(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a log of classic CAN frames as TRC."""
    return _can_log(folder / f'{name}.trc', times, columns)


def make_mcap(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a rosbag2 folder with MCAP, by the rosbags package."""
    return _bag(folder / name, 'MCAP', times, columns)


def make_sqlite(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a rosbag2 folder with sqlite3, packed by zstd as a whole."""
    return _bag(folder / name, 'SQLITE3', times, columns)


MAKERS: dict[str, Maker] = {
    'csv': make_csv, 'german_csv': make_german_csv, 'text': make_text, 'npy': make_npy,
    'comma2k19': make_comma2k19, 'npz': make_npz, 'json': make_json, 'parquet': make_parquet,
    'matlab': make_matlab, 'matlab_73': make_matlab_73, 'hdf5': make_hdf5, 'excel': make_excel,
    'mdf': make_mdf, 'mdf3': make_mdf3, 'blf': make_blf, 'asc': make_asc, 'candump': make_candump,
    'trc': make_trc, 'mcap': make_mcap, 'db3_zstd': make_sqlite,
}  # fmt: skip
"""How each format is made."""


def _table(
    path: Path,
    times: FloatArray,
    columns: Columns,
    delimiter: str,
    decimal: str,
    before: tuple[str, ...] = (),
) -> Made:
    with path.open('w', newline='', encoding='utf-8') as stream:
        stream.writelines(f'{line}\r\n' for line in before)
        writer = csv.writer(stream, delimiter=delimiter)
        writer.writerow(['t [s]', *(f'{key} [{unit}]' for key, (unit, _) in columns.items())])
        for row in np.column_stack([times, *(values for _, values in columns.values())]).tolist():
            writer.writerow([repr(value).replace('.', decimal) for value in row])
    return Made(path, {key: key for key in columns}, 't')


def _untitled(path: Path, times: FloatArray, columns: Columns) -> Made:
    rate = round((len(times) - 1) / float(times[-1] - times[0]), 6)
    names = {key: str(place) for place, key in enumerate(columns)}
    return Made(path, names, stated=Stated(rate=rate), units=False)


def _mdf(path: Path, version: str, times: FloatArray, columns: Columns) -> Made:
    from asammdf import MDF, Signal

    with MDF(version=version) as file:
        file.append([Signal(values, times, name=key, unit=unit) for key, (unit, values) in columns.items()])
        file.save(path, overwrite=True)
    return Made(path, {key: key for key in columns})


def _can_log(path: Path, times: FloatArray, columns: Columns) -> Made:
    """Write a frame with one double for each column and time, encoded by cantools."""
    from mount_driver.can_library import can, cantools

    lines = ['VERSION ""', 'NS_ :', 'BS_:', 'BU_: Sensor']
    for number, (key, (unit, _)) in enumerate(columns.items(), 256):
        lines += [
            f'BO_ {number} Frame_{key}: 8 Sensor', f' SG_ {key} : 0|64@1- (1,0) [0|0] "{unit}" Sensor', ''
        ]  # fmt: skip
    lines += [f'SIG_VALTYPE_ {number} {key} : 2;' for number, key in enumerate(columns, 256)]
    dbc = path.with_suffix('.dbc')
    dbc.write_text('\n'.join(lines) + '\n')
    database = cantools.database.load_file(dbc)
    with can.Logger(path) as log:
        for place, time in enumerate(times.tolist()):
            for key, (_, values) in columns.items():
                message = database.get_message_by_name(f'Frame_{key}')
                data = message.encode({key: float(values[place])})
                log(can.Message(
                    timestamp=BEGIN + time, arbitration_id=message.frame_id, data=data, is_extended_id=False,
                    channel=0,
                ))  # fmt: skip
    return Made(path, {key: key for key in columns}, stated=Stated(dbc=dbc))


def _bag(folder: Path, storage: str, times: FloatArray, columns: Columns) -> Made:
    """Write `/signals`, a JointState with a position for each column."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    kinds = store.types
    state, header, stamp = (
        kinds[name]
        for name in ('sensor_msgs/msg/JointState', 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time')
    )
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin[storage])
    if storage == 'SQLITE3':
        writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    table, none = np.column_stack([values for _, values in columns.values()]), np.empty(0)
    with writer:
        connection = writer.add_connection('/signals', state.__msgtype__, typestore=store)
        for time, row in zip(times.tolist(), table, strict=True):
            nanoseconds = BEGIN * 10**9 + round(time * 1e9)
            head = header(stamp=stamp(*divmod(nanoseconds, 10**9)), frame_id='')
            message = state(header=head, name=list(columns), position=row, velocity=none, effort=none)
            writer.write(connection, nanoseconds + 1_000_000, store.serialize_cdr(message, state.__msgtype__))
    return Made(folder, {key: key for key in columns}, units=False)
