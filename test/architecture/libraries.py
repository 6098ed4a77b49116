"""What the code may import from others, and where an installation gets it from.

The keys are those of rosdistro's `rosdep/python.yaml`; ROS packages bear the name that is imported.
"""

from typing import NamedTuple


class Library(NamedTuple):
    """A library by its project on PyPI and its key in rosdep; without a key it comes by pip everywhere."""

    project: str
    key: str | None = None


LIBRARIES = {
    'aiohttp': Library('aiohttp', 'python3-aiohttp'),
    'asammdf': Library('asammdf'),
    'asyncssh': Library('asyncssh', 'python3-asyncssh'),
    'bitstruct': Library('bitstruct'),
    'can': Library('python-can', 'python3-can'),
    'cantools': Library('cantools', 'python3-cantools-pip'),
    'cloudpickle': Library('cloudpickle'),
    'distributed': Library('distributed'),
    'duckdb': Library('duckdb'),
    'e2e': Library('autosar-e2e'),
    'foxglove': Library('foxglove-sdk'),
    'fsspec': Library('fsspec'),
    'gcsfs': Library('gcsfs'),
    'h5py': Library('h5py', 'python3-h5py'),
    'hypothesis': Library('hypothesis', 'python3-hypothesis'),
    'lz4': Library('lz4'),
    'matplotlib': Library('matplotlib', 'python3-matplotlib'),
    'psutil': Library('psutil', 'python3-psutil'),
    'mcap': Library('mcap'),
    'mcap_ros2': Library('mcap-ros2-support', 'mcap-ros2-support'),
    'moto': Library('moto'),
    'msgpack': Library('msgpack', 'python3-msgpack'),
    'numba': Library('numba'),  # python3-numba is a key, but of a package that Ubuntu 24.04 does not have
    'numpy': Library('numpy', 'python3-numpy'),
    'openpyxl': Library('openpyxl', 'python3-openpyxl'),
    'pyarrow': Library('pyarrow'),
    'pytest': Library('pytest', 'python3-pytest'),
    'rich': Library('rich', 'python3-rich'),
    'rosbags': Library('rosbags', 'python3-rosbags-pip'),
    's3fs': Library('s3fs'),
    'scipy': Library('scipy', 'python3-scipy'),
    'skfem': Library('scikit-fem'),
    'sshfs': Library('sshfs'),
    'threadpoolctl': Library('threadpoolctl'),
    'typer': Library('typer', 'python3-typer'),
    'yaml': Library('PyYAML', 'python3-yaml'),
    'zstandard': Library('zstandard'),
}

ROS = {
    'ament_index_python', 'diagnostic_msgs', 'geometry_msgs', 'launch', 'lifecycle_msgs',
    'rcl_interfaces', 'rclpy', 'sensor_msgs', 'std_msgs', 'std_srvs',
}  # fmt: skip
