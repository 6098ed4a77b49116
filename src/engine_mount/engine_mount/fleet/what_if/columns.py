"""What stands in the table of `fleet replay`: a row for each mount of each recording."""

from engine_mount.fleet.columns import COUNT, FLAG, NUMBER, TEXT, Column

SETPOINTS, DISPLACEMENT = 'setpoints', 'displacement'
"""What a row answers: other setpoints to the recorded displacement, or another displacement."""

REPLAYED, ANOTHER_POLICY, FAILED = 'replayed', 'another policy', 'failed'
"""What came of a recording; the change does not concern one whose policy lacks a changed parameter."""

_CHANGED = 'the same with the change'

_RECORDING = (
    Column('recording', TEXT, '', 'path of the recording below what was asked for'),
    Column('mount', TEXT, '', 'which of several mounts, empty where there is one'),
    Column('reason', TEXT, '', 'why this recording has no figures, empty where it has'),
    Column(
        'outcome', TEXT, '', 'replayed, another policy (which does not have a changed parameter) or failed'
    ),
    Column('asked', TEXT, '', 'setpoints (replayed) or displacement (simulated anew: --closed-loop)'),
    Column('size_bytes', COUNT, 'B', 'size of its files'),
    Column('sha256', TEXT, '', 'SHA-256 of its MCAP files; null where all its mounts have another policy'),
    Column('recorded_with', TEXT, '', 'version of this project that made the recording, where it tells'),
    Column('replayed_with', TEXT, '', 'versions of the project and of the libraries that replayed it, JSON'),
    Column('mapping_file', TEXT, '', 'mapping file of a file of others; empty: read by titles and units'),
    Column('mapped', TEXT, '', 'columns of a file of others that were taken, JSON {quantity: column}'),
    Column('changes', TEXT, '', 'what was other than recorded, {node: {parameter: value}}, JSON'),
)

_SAMPLES = (
    Column('duration_s', NUMBER, 's', 'length of what the controller was given'),
    Column('samples', COUNT, '', 'samples that it was given'),
    Column('activations', COUNT, '', 'how often it was activated'),
    Column('as_recorded', FLAG, '', 'whether the replay without the change gives the recorded setpoints'),
    Column(
        'as_recorded_largest_a', NUMBER, 'A', 'largest difference of that replay from the recorded setpoints'
    ),
)

_SETPOINTS = (
    Column('setpoints_differing', COUNT, '', 'setpoints that the change made others'),
    Column('setpoint_difference_rms_a', NUMBER, 'A', 'rms of the difference that the change made'),
    Column('setpoint_difference_largest_a', NUMBER, 'A', 'largest difference, changed minus as recorded'),
    Column('setpoint_difference_largest_at_s', NUMBER, 's', 'when, on the time axis of the recording'),
    Column('setpoint_difference_first_at_s', NUMBER, 's', 'when the first setpoint differs'),
    Column('peak_current_a', NUMBER, 'A', 'largest setpoint as recorded'),
    Column('peak_current_changed_a', NUMBER, 'A', _CHANGED),
    Column('mean_current_a', NUMBER, 'A', 'mean of all setpoints as recorded'),
    Column('mean_current_changed_a', NUMBER, 'A', _CHANGED),
)

_DAMPING = (
    Column('switched_on', COUNT, '', 'how often damping went on, as recorded'),
    Column('switched_on_changed', COUNT, '', _CHANGED),
    Column('switchings_appeared', COUNT, '', 'switchings of damping, on or off, that only the change has'),
    Column('switchings_vanished', COUNT, '', 'switchings that the change does not have'),
    Column('switchings_moved', COUNT, '', 'switchings that the change has at another time'),
    Column('switching_moved_furthest_s', NUMBER, 's', 'by how much the one that moved furthest came later'),
    Column('damping_s', NUMBER, 's', 'time for which damping was on, as recorded'),
    Column('damping_changed_s', NUMBER, 's', _CHANGED),
)

_FRICTION = (
    Column(
        'peak_friction_n',
        NUMBER,
        'N',
        'largest friction force that the force model of the controller predicts, as recorded',
    ),
    Column('peak_friction_changed_n', NUMBER, 'N', _CHANGED),
    Column('rms_friction_n', NUMBER, 'N', 'rms of the predicted friction force, as recorded'),
    Column('rms_friction_changed_n', NUMBER, 'N', _CHANGED),
    Column('pad_energy_j', NUMBER, 'J', 'energy that the pads take by the predicted friction, as recorded'),
    Column('pad_energy_changed_j', NUMBER, 'J', _CHANGED),
)

_MOTION = (
    Column(
        'displacement_difference_rms_m',
        NUMBER,
        'm',
        'rms of the difference of the two simulated displacements (--closed-loop)',
    ),
    Column('displacement_difference_largest_m', NUMBER, 'm', 'largest difference, changed minus as recorded'),
    Column(
        'displacement_difference_largest_at_s', NUMBER, 's', 'when, from the beginning of the acceleration on'
    ),
    Column('peak_displacement_m', NUMBER, 'm', 'largest displacement, simulated as recorded (--closed-loop)'),
    Column('peak_displacement_changed_m', NUMBER, 'm', _CHANGED),
    Column('rms_displacement_m', NUMBER, 'm', 'rms of the displacement, simulated as recorded'),
    Column('rms_displacement_changed_m', NUMBER, 'm', _CHANGED),
    Column('peak_mount_force_n', NUMBER, 'N', 'largest force of the mount, simulated as recorded'),
    Column('peak_mount_force_changed_n', NUMBER, 'N', _CHANGED),
)

REPLAY_COLUMNS = (*_RECORDING, *_SAMPLES, *_SETPOINTS, *_DAMPING, *_FRICTION, *_MOTION)
"""The columns of `result.parquet`, in their order; its rows are sorted by recording and mount."""
