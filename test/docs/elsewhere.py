"""Commands of pages that their test does not run as they stand, and what runs them instead."""

_INSTALLATION = 'on a ROS 2 installation; test/architecture/test_car.py holds what it installs and loads'
_HARDWARE = 'by nobody: with a CAN FD adapter and the electronics of a mount'
_LAUNCH = 'on a ROS 2 installation; test/graph/test_drive.py drives the same nodes'
_BAG_PLAY = 'on a ROS 2 installation; src/mount_control/test plays to the same control'
_RECORD = 'beside a running graph in test/graph/test_recording.py'
_RQT = 'by nobody: on a ROS 2 installation; src/mount_bringup/test/test_aggregator.py holds the groups'
_VIEW = 'with clients of its own in src/engine_mount/test/view'
_SET = 'on a running node in test/replay/test_parameter_changes.py'

ELSEWHERE = {
    'make drive': 'in real time by test/graph/test_drive.py',
    'make test': 'it is what runs this',
    'make test-arm64': 'needs compilers and emulators; docs/explanation/same_bytes.md has the last result',
    'make test-cortex-m': 'needs compilers and emulators; docs/explanation/same_bytes.md has the last result',
    'make test-socketcan': 'needs an emulator; src/mount_driver/README.md has the last result',
    'make check': 'the command of docs/how-to/check_a_change.md is the same',
    'make setup-dev': 'it made the environment that this runs in',
    'make lint': 'by .ci/run',
    '. .venv/bin/activate': 'the commands are run in that environment',
    'export PIP_BREAK_SYSTEM_PACKAGES': _INSTALLATION,
    'rosdep install': _INSTALLATION,
    'python3 -m pip install': _INSTALLATION,
    'colcon build': _INSTALLATION,
    'sudo ip link set': _HARDWARE,
    'ip -details': _HARDWARE,
    'candump': _HARDWARE,
    'ros2 run mount_driver': _HARDWARE,
    'ros2 lifecycle set /mount_right/': _HARDWARE,
    'ros2 topic hz /mount_right/': _HARDWARE,
    'ros2 topic echo': _HARDWARE,
    'ros2 run diagnostic_aggregator': _RQT,
    'ros2 run rqt_': _RQT,
    'ros2 launch mount_bringup vehicle.launch.py': _LAUNCH,
    'ros2 launch mount_bringup sim.launch.py': _LAUNCH,
    'export ROS_DOMAIN_ID': _BAG_PLAY,
    'ros2 run mount_control': _BAG_PLAY,
    'ros2 lifecycle set /mount_control': _BAG_PLAY,
    'ros2 bag play': _BAG_PLAY,
    'ros2 service call /mount_right/mount_recorder/mark': _RECORD,
    'ros2 topic pub --once /mount_right/event': _RECORD,
    'ros2 param set /mount_right/mount_control': _SET,
    'engine-mount record --': _RECORD,
    'engine-mount view': _VIEW,
    'engine-mount status': _VIEW,
    'engine-mount identify friction --train': 'long: src/engine_mount/test/cli/test_identify_friction.py',
}
"""{beginning of the commands: where they are run}."""

STAND_INS = {
    'make drive': 'engine-mount drive --lockstep',
    "make drive DRIVE_OPTIONS='--out bags/first'": 'engine-mount drive --lockstep --out bags/first',
}
"""{command: what the test of the page runs in its place}."""
