"""Files of measured signals in every format that is read, each by a writer that is not of this project.

`MAKERS` is {format: function(folder, name, times, columns) -> Made}: `times` (n,) in s, `columns`
{name: (unit, values (n,))}. Names of columns should be plain words.
"""

from engine_mount.signals.testing.arrays import (
    make_comma2k19,
    make_excel,
    make_hdf5,
    make_matlab,
    make_matlab_73,
    make_npy,
    make_npz,
    make_parquet,
)
from engine_mount.signals.testing.bags import (
    make_mcap,
    make_sqlite,
)
from engine_mount.signals.testing.buses import (
    make_asc,
    make_blf,
    make_candump,
    make_mdf,
    make_mdf3,
    make_mdf_frames,
    make_trc,
)
from engine_mount.signals.testing.made import Made, Maker
from engine_mount.signals.testing.texts import (
    make_csv,
    make_german_csv,
    make_json,
    make_text,
)

__all__ = ['MAKERS', 'Made', 'make_csv', 'make_mdf', 'make_mdf_frames']

MAKERS: dict[str, Maker] = {
    'csv': make_csv, 'german_csv': make_german_csv, 'text': make_text, 'npy': make_npy,
    'comma2k19': make_comma2k19, 'npz': make_npz, 'json': make_json, 'parquet': make_parquet,
    'matlab': make_matlab, 'matlab_73': make_matlab_73, 'hdf5': make_hdf5, 'excel': make_excel,
    'mdf': make_mdf, 'mdf3': make_mdf3, 'blf': make_blf, 'asc': make_asc, 'candump': make_candump,
    'trc': make_trc, 'mdf_frames': make_mdf_frames, 'mcap': make_mcap, 'db3_zstd': make_sqlite,
}  # fmt: skip
"""How each format is made."""
