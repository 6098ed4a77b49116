"""A long drive is recorded in the memory of a short one."""

import tracemalloc

from engine_mount.drives.drive import check_drive
from engine_mount.drives.loop.recording import record_core


def peak_of_core(folder, duration):
    parameters = {'mount_sim': {'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': duration}}
    excitation = check_drive(parameters)
    tracemalloc.start()
    outcome = record_core(folder, parameters, 'session', excitation=excitation)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return outcome.samples, peak


def test_a_drive_is_recorded_in_blocks_of_fixed_size(tmp_path):
    peak_of_core(tmp_path / 'warm', 0.5)  # compiles, and loads what is loaded once
    (short, before), (long, after) = (peak_of_core(tmp_path / f'{each}', each) for each in (2.0, 8.0))
    assert (after - before) / (long - short) < 40  # bytes of a sample: the index of the recording
