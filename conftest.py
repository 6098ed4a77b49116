"""What the tests of all packages share: the fixtures of `mount_ros.testing`."""

pytest_plugins = ['mount_ros.testing']
