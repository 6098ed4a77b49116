"""Files of measured signals in every format that is read, each by a writer that is not of this project.

`MAKERS` is {format: function(folder, name, times, columns) -> Made}: `times` (n,) in s, `columns`
{name: (unit, values (n,))}. Names of columns are plain words.
"""

import csv
import gzip
import json
import struct
from pathlib import Path
from typing import NamedTuple

import numpy as np

from engine_mount.signals.formats.content import Stated

BEGIN = 1_700_000_000  # s since 1970, of formats that tell a date


class Made(NamedTuple):
    """A file: its place, the names of columns and of that of times, what must be stated, has it units."""

    path: Path
    names: dict
    time: str = ''
    stated: Stated = Stated()
    units: bool = True


def own_names(columns):
    return {key: key for key in columns}


def numbers(columns):
    return {key: str(place) for place, key in enumerate(columns)}


def stacked(columns):
    return np.column_stack([values for _, values in columns.values()])


# Texts.


def make_csv(folder, name, times, columns):
    """Write a CSV file with units in brackets."""
    return _table(folder / f'{name}.csv', times, columns, ',', '.')


def make_german_csv(folder, name, times, columns):
    """Write a table with semicolons, decimal commas, and lines before the titles."""
    return _table(folder / f'{name}.csv', times, columns, ';', ',', ('Messung;12', 'Bediener;Meier', ''))


def _table(path, times, columns, delimiter, decimal, before=()):
    with path.open('w', newline='', encoding='utf-8') as stream:
        stream.writelines(f'{line}\r\n' for line in before)
        writer = csv.writer(stream, delimiter=delimiter)
        writer.writerow(['t [s]', *(f'{key} [{unit}]' for key, (unit, _) in columns.items())])
        for row in np.column_stack([times, stacked(columns)]).tolist():
            writer.writerow([repr(value).replace('.', decimal) for value in row])
    return Made(path, own_names(columns), 't')


def make_gzip(folder, name, times, columns):
    """Write a CSV file and compress it."""
    made = make_csv(folder, name, times, columns)
    path = folder / f'{name}.csv.gz'
    path.write_bytes(gzip.compress(made.path.read_bytes()))
    return made._replace(path=path)


def lvm(form):
    """Return the maker of a LabVIEW measurement with one, several or no columns of X."""

    def make(folder, name, times, columns):
        count, path = len(columns), folder / f'{name}.lvm'
        header = {
            'Writer_Version': ['2'],
            'Separator': ['Tab'],
            'Decimal_Separator': ['.'],
            'X_Columns': [form],
        }
        units = [unit for unit, _ in columns.values()]
        segment = {
            'Channels': [str(count)], 'Y_Unit_Label': units, 'X_Dimension': ['Time'] * count,
            'X0': [repr(float(times[0]))] * count, 'Delta_X': [repr(float(times[1] - times[0]))] * count,
        }  # fmt: skip
        lines = ['LabVIEW Measurement\t']
        for part in (header, segment):
            lines += ['\t'.join([key, *cells, '']) for key, cells in part.items()]
            lines += ['***End_of_Header***\t', '\t'] if part is header else ['***End_of_Header***\t']
        titles = (
            'X_Value\t'.join(f'{key}\t' for key in columns) if form == 'Multi' else '\t'.join([*columns, ''])
        )
        lines += [f'X_Value\t{titles}Comment']
        for time, row in zip(times.tolist(), stacked(columns).tolist(), strict=True):
            x = '' if form == 'No' else repr(time)
            lines += [
                '\t'.join(f'{x}\t{value!r}' for value in row)
                if form == 'Multi'
                else '\t'.join([x, *map(repr, row)])
            ]
        path.write_text('\r\n'.join(lines) + '\r\n', newline='')
        return Made(path, own_names(columns))

    return make


def make_text(folder, name, times, columns):
    """Write blanks between the cells, by numpy, without titles; the times come first."""
    path = folder / f'{name}.txt'
    np.savetxt(path, np.column_stack([times, stacked(columns)]), fmt='%25.17g')
    return Made(path, {key: str(place) for place, key in enumerate(columns, 1)}, '0', units=False)


def make_json(folder, name, times, columns):
    """Write a JSON file of nested lists."""
    path = folder / f'{name}.json'
    data = {key: {'unit': unit, 'values': values.tolist()} for key, (unit, values) in columns.items()}
    path.write_text(json.dumps({'meta': {'car': 'x'}, 'signals': {'t': times.tolist(), **data}}))
    return Made(path, {key: f'{key}.values' for key in columns}, 't')


# Arrays and tables of tools.


def make_npy(folder, name, times, columns):
    """Write two NPY files that belong together."""
    np.save(folder / f'{name}_t.npy', times)
    np.save(folder / f'{name}_value.npy', stacked(columns))
    return Made(folder / f'{name}_value.npy', numbers(columns), units=False)


def make_comma2k19(folder, name, times, columns):
    """Write the layout of comma2k19: NPY files `t` and `value` without a suffix."""
    place = folder / name / 'processed_log' / 'IMU' / 'accelerometer'
    place.mkdir(parents=True)
    for file, array in (('t', times), ('value', stacked(columns))):
        with (place / file).open('wb') as stream:
            np.save(stream, array)
    return Made(place, numbers(columns), units=False)


def make_npz(folder, name, times, columns):
    """Write an NPZ file with a named array for each column."""
    path = folder / f'{name}.npz'
    np.savez_compressed(path, t=times, **{key: values for key, (_, values) in columns.items()})
    return Made(path, own_names(columns), 't', units=False)


def make_parquet(folder, name, times, columns):
    """Write a Parquet file with units in the metadata of its columns."""
    import pyarrow
    from pyarrow import parquet

    whole = {'t': ('s', times), **columns}
    fields = [
        pyarrow.field(key, pyarrow.float64(), metadata={'unit': unit}) for key, (unit, _) in whole.items()
    ]
    path = folder / f'{name}.parquet'
    arrays = [values for _, values in whole.values()]
    parquet.write_table(pyarrow.table(arrays, schema=pyarrow.schema(fields)), path)
    return Made(path, own_names(columns), 't')


def make_matlab(folder, name, times, columns):
    """Write a MATLAB 5 file with a struct of columns."""
    from scipy.io import savemat

    path = folder / f'{name}.mat'
    savemat(path, {'rec': {'t': times, **{key: values for key, (_, values) in columns.items()}}})
    return Made(path, own_names(columns), 't', units=False)


def make_matlab_sparse(folder, name, times, columns):
    """Write a MATLAB 5 file with sparse columns."""
    from scipy.io import savemat
    from scipy.sparse import csc_array

    path = folder / f'{name}.mat'
    savemat(path, {'t': times, **{key: csc_array(one[:, np.newaxis]) for key, (_, one) in columns.items()}})
    return Made(path, own_names(columns), 't', units=False)


def make_matlab_73(folder, name, times, columns):
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
    return Made(path, own_names(columns), 't', units=False)


def make_hdf5(folder, name, times, columns):
    """Write an HDF5 file with units as attributes."""
    import h5py

    path = folder / f'{name}.h5'
    with h5py.File(path, 'w') as file:
        for key, (unit, values) in {'t': ('s', times), **columns}.items():
            made = file.create_dataset(f'rec/{key}', data=values, chunks=True, compression='gzip')
            made.attrs['unit'] = unit
    return Made(path, own_names(columns), 't')


def make_excel(folder, name, times, columns):
    """Write a workbook with units below the titles and a sheet of remarks."""
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = 'Messung'
    sheet.append(['t', *columns])
    sheet.append(['s', *(unit for unit, _ in columns.values())])
    for row in np.column_stack([times, stacked(columns)]).tolist():
        sheet.append(row)
    book.create_sheet('Bemerkungen').append(['keine'])
    path = folder / f'{name}.xlsx'
    book.save(path)
    return Made(path, own_names(columns), 't')


# Measuring systems and loggers of buses.


def make_mdf(folder, name, times, columns):
    """Write an MDF 4 file."""
    return _mdf(folder / f'{name}.mf4', '4.10', times, columns)


def make_mdf3(folder, name, times, columns):
    """Write an MDF 3 file."""
    return _mdf(folder / f'{name}.mdf', '3.30', times, columns)


def _mdf(path, version, times, columns):
    from asammdf import MDF, Signal

    with MDF(version=version) as file:
        file.append([Signal(values, times, name=key, unit=unit) for key, (unit, values) in columns.items()])
        file.save(path, overwrite=True)
    return Made(path, own_names(columns))


def make_mdf_frames(folder, name, times, columns):
    """Write raw frames of a bus logger into an MDF 4 file, by asammdf."""
    path = folder / f'{name}.mf4'
    dbc, frames = _encoded(path, times, columns)
    write_frames(path, [(time, 1, identifier, data) for time, identifier, data in frames])
    return Made(path, own_names(columns), stated=Stated(dbc=dbc))


def write_frames(path, frames):
    """Write frames (time in s, bus, identifier, bytes) as ASAM MDF bus logging says, by asammdf."""
    from asammdf import MDF, Signal
    from asammdf.blocks.source_utils import Source
    from asammdf.blocks.v4_constants import BUS_TYPE_CAN, FLAG_CG_BUS_EVENT, SOURCE_BUS

    members = [
        ('BusChannel', 'u1'), ('ID', '<u4'), ('IDE', 'u1'), ('DLC', 'u1'), ('DataLength', 'u1'),
        ('DataBytes', '(8,)u1'),
    ]  # fmt: skip
    records = np.zeros(len(frames), [(f'CAN_DataFrame.{member}', kind) for member, kind in members])
    for row, (_, bus, identifier, data) in zip(records, frames, strict=True):
        row['CAN_DataFrame.BusChannel'], row['CAN_DataFrame.ID'] = bus, identifier
        row['CAN_DataFrame.DLC'] = row['CAN_DataFrame.DataLength'] = len(data)
        row['CAN_DataFrame.DataBytes'][: len(data)] = np.frombuffer(data, np.uint8)
    source = Source('CAN', 'CAN', '', SOURCE_BUS, BUS_TYPE_CAN)
    stamps = np.array([frame[0] for frame in frames])
    with MDF(version='4.10') as file:
        file.append(Signal(records, stamps, name='CAN_DataFrame', source=source), acq_source=source)
        file.groups[-1].channel_group.flags |= FLAG_CG_BUS_EVENT
        file.save(path, overwrite=True)


def can_log(suffix):
    """Return the maker of a log of CAN frames, by python-can."""

    def make(folder, name, times, columns):
        from mount_driver.can_library import can

        path = folder / f'{name}.{suffix}'
        dbc, frames = _encoded(path, times, columns)
        with can.Logger(path) as log:
            for time, identifier, data in frames:
                plain = {'is_extended_id': False, 'channel': 0}
                log(can.Message(timestamp=BEGIN + time, arbitration_id=identifier, data=data, **plain))
        return Made(path, own_names(columns), stated=Stated(dbc=dbc))

    return make


def _encoded(path, times, columns):
    """Return a database beside `path`, and a frame (time, identifier, bytes) of a double for each sample."""
    from mount_driver.can_library import cantools

    lines = ['VERSION ""', 'NS_ :', 'BS_:', 'BU_: Sensor']
    for number, (key, (unit, _)) in enumerate(columns.items(), 256):
        lines += [
            f'BO_ {number} Frame_{key}: 8 Sensor', f' SG_ {key} : 0|64@1- (1,0) [0|0] "{unit}" Sensor', ''
        ]  # fmt: skip
    lines += [f'SIG_VALTYPE_ {number} {key} : 2;' for number, key in enumerate(columns, 256)]
    dbc = path.with_suffix('.dbc')
    dbc.write_text('\n'.join(lines) + '\n')
    database = cantools.database.load_file(dbc)
    frames = []
    for place, time in enumerate(times.tolist()):
        for key, (_, values) in columns.items():
            message = database.get_message_by_name(f'Frame_{key}')
            frames.append((time, message.frame_id, message.encode({key: float(values[place])})))
    return dbc, frames


# Recordings of ROS 2.


def make_mcap(folder, name, times, columns):
    """Write a rosbag2 folder with MCAP, by the rosbags package."""
    return _bag(folder / name, 'MCAP', times, columns)


def make_sqlite(folder, name, times, columns):
    """Write a rosbag2 folder with sqlite3, packed by zstd as a whole."""
    return _bag(folder / name, 'SQLITE3', times, columns)


def _bag(folder, storage, times, columns):
    """Write `/signals`, a JointState with a position for each column."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    names = ('sensor_msgs/msg/JointState', 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time')
    state, header, stamp = (store.types[name] for name in names)
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin[storage])
    if storage == 'SQLITE3':
        writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    none = np.empty(0)
    with writer:
        connection = writer.add_connection('/signals', state.__msgtype__, typestore=store)
        for time, row in zip(times.tolist(), stacked(columns), strict=True):
            nanoseconds = BEGIN * 10**9 + round(time * 1e9)
            head = header(stamp=stamp(*divmod(nanoseconds, 10**9)), frame_id='')
            message = state(header=head, name=list(columns), position=row, velocity=none, effort=none)
            writer.write(connection, nanoseconds + 1_000_000, store.serialize_cdr(message, state.__msgtype__))
    return Made(folder, own_names(columns), units=False)


MAKERS = {
    'csv': make_csv, 'csv_gz': make_gzip,
    'lvm_one': lvm('One'), 'lvm_multi': lvm('Multi'), 'lvm_no': lvm('No'),
    'matlab_sparse': make_matlab_sparse, 'german_csv': make_german_csv, 'text': make_text, 'npy': make_npy,
    'comma2k19': make_comma2k19, 'npz': make_npz, 'json': make_json, 'parquet': make_parquet,
    'matlab': make_matlab, 'matlab_73': make_matlab_73, 'hdf5': make_hdf5, 'excel': make_excel,
    'mdf': make_mdf, 'mdf3': make_mdf3, 'blf': can_log('blf'), 'asc': can_log('asc'),
    'candump': can_log('log'), 'trc': can_log('trc'), 'mdf_frames': make_mdf_frames,
    'mcap': make_mcap, 'db3_zstd': make_sqlite,
}  # fmt: skip
"""How each format is made."""
