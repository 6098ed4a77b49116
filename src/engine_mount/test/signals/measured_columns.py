"""Files as readers give them, made of a few columns: `{'az [g]': values}`."""

import numpy as np

from engine_mount.signals.formats.measured import Measured, MeasuredColumn, Provenance, TimeBase

TIMES = np.arange(4000) / 1000.0  # s
RANDOM = np.random.default_rng(17)
SHAKING = 0.3 * RANDOM.standard_normal(TIMES.size)  # m/s^2
TRAVEL = 0.8e-3 * np.sin(2.0 * np.pi * 8.0 * TIMES)  # m


def measured(columns, name='drive.csv', begin=None):
    """Return a file of columns by header; with `begin` (ns) the format tells the times of `TIMES`."""
    time = None if begin is None else TimeBase(TIMES, begin, 'times of the format')
    found = {}
    for number, (header, values) in enumerate(columns.items()):
        title, _, unit = header.partition(' [')
        found[title] = MeasuredColumn(
            title, header, unit.rstrip(']'), number, values=np.asarray(values, float), time=time
        )
    return Measured(found, Provenance(f'/data/{name}', 'f00d', 1, 'CSV', 'made'))
