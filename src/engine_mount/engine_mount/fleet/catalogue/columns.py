"""What a catalogue tells of each recording, and of each event in it."""

from engine_mount.drives.bands import BELOW_ISOLATION, ISOLATION_BANDS
from engine_mount.fleet.columns import COUNT, FLAG, NUMBER, TEXT, TIME, Column

BANDS = (BELOW_ISOLATION, *ISOLATION_BANDS)

DRIVE, REPLAY, FOREIGN, OTHER, UNREADABLE = 'drive', 'replay', 'foreign', 'other', 'unreadable'
"""Kinds of a recording; `foreign` is a file of others, `other` holds no displacement of a mount."""

_PLACE = (
    Column('uri', TEXT, '', 'where the recording lies: its folder, or its file'),
    Column('recording', TEXT, '', 'the same below the place that was given to the catalogue'),
    Column('mount', TEXT, '', 'which of several mounts the row tells of; empty where there is one'),
)
_WHAT = (
    Column(
        'kind',
        TEXT,
        '',
        'drive, replay, foreign (a file of others), other (no displacement of a mount) or unreadable',
    ),
    Column('reason', TEXT, '', 'why nothing, or not all, of it can be read or told; empty where all can'),
    Column('whole', FLAG, '', 'whether nothing of the files is known to be damaged or missing'),
    Column('size_bytes', COUNT, 'B', 'size of its files'),
    Column('fingerprint', TEXT, '', 'of sizes, times and etags of its files; empty: read again next time'),
    Column('scenario', TEXT, '', 'what was driven, as the session tells'),
    Column('mode', TEXT, '', 'real time, lock-step or core'),
    Column('simulated_mount', TEXT, '', 'which mount the simulator had; empty in a car'),
    Column('policy', TEXT, '', 'parameter mount_control.policy of the session'),
    Column('started', TIME, '', 'when it began (UTC), by its session, else by its first message'),
    Column('duration_s', NUMBER, 's', 'length: of the displacement by its rate, else of all messages'),
    Column(
        'distance_m',
        NUMBER,
        'm',
        'speed of the car times duration, where the session, or a column of a file of others, tells a speed',
    ),
    Column('version', TEXT, '', 'version of this project by which it was made'),
    Column('versions', TEXT, '', 'all versions by which it was made, JSON'),
    Column('parameters', TEXT, '', 'parameters that are not at their default, JSON {node.parameter: value}'),
    Column('messages', COUNT, '', 'messages in its files, of all mounts'),
)
_OF_OTHERS = (
    Column('columns', TEXT, '', 'columns of a file of others, JSON {column: unit that its header tells}'),
    Column('mapping_file', TEXT, '', 'mapping file by which it was read; empty: by titles and units'),
    Column('mapped', TEXT, '', 'what of it was taken, JSON {quantity: column}'),
    Column('rate_hz', NUMBER, 'Hz', 'samples per second of what was taken'),
    Column(
        'rms_acceleration_m_s2',
        NUMBER,
        'm/s^2',
        'rms of the acceleration of the chassis in a file of others, about its mean',
    ),
)
_LOST = (
    Column('samples', COUNT, '', 'samples from the first to the last displacement, lost ones included'),
    Column('lost_samples', COUNT, '', 'of these without displacement or coil ripple'),
    Column('lost_messages', COUNT, '', 'messages of all topics that were sent and are not there'),
    Column('asked_samples', COUNT, '', 'samples while control was active'),
    Column('unanswered_samples', COUNT, '', 'of these without a setpoint'),
    Column('late_samples', COUNT, '', 'of these with a setpoint that came too late'),
    Column('misdated_messages', COUNT, '', 'messages whose stamp is that of no sample'),
    Column('faults', COUNT, '', 'errors of nodes, marked faults, and times without setpoints'),
    Column('first_fault', TEXT, '', 'when the first of them was, and what it said'),
    Column('latency_median_s', NUMBER, 's', 'from the stamp of a sample to the arrival of its setpoint'),
    Column('latency_p99_s', NUMBER, 's', 'in 99 of 100 samples it was shorter'),
    Column('latency_worst_s', NUMBER, 's', 'the longest'),
)
_STATE = (
    Column('rest_gap_m', NUMBER, 'm', 'as measured by the last initialisation'),
    Column('contact_gap_m', NUMBER, 'm', 'as measured by the last initialisation'),
    Column('offset_current_a', NUMBER, 'A', 'current of the ready position, of the last initialisation'),
    Column('coil_temperature_degc', NUMBER, 'degC', 'highest temperature of the coil'),
    Column(
        'switched_on',
        COUNT,
        '',
        'how often damping was switched on; null in a mount without friction',
    ),
    Column('damping_s', NUMBER, 's', 'how long damping was on'),
    Column('peak_current_a', NUMBER, 'A', 'highest setpoint while control was active'),
    Column(
        'pad_energy_j',
        NUMBER,
        'J',
        'work of the friction in the pads, as the friction law of control tells it',
    ),
    Column('peak_displacement_m', NUMBER, 'm', 'largest absolute displacement'),
    Column('rms_displacement_m', NUMBER, 'm', 'rms of the displacement about its mean'),
)


def band_name(figure: str, band: tuple[float, float]) -> str:
    """Return the column of `figure` (peak or rms) of the displacement in a band (Hz)."""
    return f'{figure}_{band[0]:g}_{band[1]:g}_hz_m'


_IN_BANDS = tuple(
    Column(
        band_name(figure, band),
        NUMBER,
        'm',
        f'{words} the displacement from {band[0]:g} to {band[1]:g} Hz',
    )
    for figure, words in (('peak', 'largest absolute value of'), ('rms', 'rms of'))
    for band in BANDS
)

RECORDINGS = (*_PLACE, *_WHAT, *_LOST, *_STATE, *_IN_BANDS, *_OF_OTHERS)
"""A row for each mount of each recording."""

EVENTS = (
    *_PLACE,
    Column('time_s', NUMBER, 's', 'when it happened, on the time axis of the recording'),
    Column('stamp_ns', COUNT, 'ns', 'when it happened, on the clock of the stamps'),
    Column('kind', TEXT, '', 'switch_on, switch_off, fault, mark, parameter, ...'),
    Column('text', TEXT, '', 'what its mark says'),
)
"""A row for each event: marks, and where these tell of no switching, the changes of damping."""
