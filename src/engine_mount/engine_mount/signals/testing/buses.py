"""What measuring systems and loggers of buses write: MDF and CAN logs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import FloatArray
from engine_mount.signals.testing.made import BEGIN, Columns, Made


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


def make_mdf_frames(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write raw frames of a bus logger into an MDF 4 file, by asammdf."""
    path = folder / f'{name}.mf4'
    dbc, frames = _encoded(path, times, columns)
    write_frames(path, [(time, 1, identifier, data) for time, identifier, data in frames])
    return Made(path, {key: key for key in columns}, stated=Stated(dbc=dbc))


def write_frames(path: Path, frames: Sequence[tuple[float, int, int, bytes]]) -> None:
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
        group: Any = file.groups[-1].channel_group
        group.flags |= FLAG_CG_BUS_EVENT
        file.save(path, overwrite=True)


def _mdf(path: Path, version: str, times: FloatArray, columns: Columns) -> Made:
    from asammdf import MDF, Signal

    with MDF(version=version) as file:
        file.append([Signal(values, times, name=key, unit=unit) for key, (unit, values) in columns.items()])
        file.save(path, overwrite=True)
    return Made(path, {key: key for key in columns})


def _can_log(path: Path, times: FloatArray, columns: Columns) -> Made:
    from mount_driver.can_library import can

    dbc, frames = _encoded(path, times, columns)
    with can.Logger(path) as log:
        for time, identifier, data in frames:
            log(can.Message(
                timestamp=BEGIN + time, arbitration_id=identifier, data=data, is_extended_id=False, channel=0,
            ))  # fmt: skip
    return Made(path, {key: key for key in columns}, stated=Stated(dbc=dbc))


def _encoded(path: Path, times: FloatArray, columns: Columns) -> tuple[Path, list[tuple[float, int, bytes]]]:
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
