"""Arrays and tables of tools: NPY, NPZ, Parquet, MATLAB, HDF5, Excel."""

import struct
from pathlib import Path

import numpy as np

from engine_mount.signals.formats.measured import FloatArray
from engine_mount.signals.testing.made import Columns, Made


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
