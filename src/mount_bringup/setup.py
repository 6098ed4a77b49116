from glob import glob

from setuptools import find_packages, setup

name = 'mount_bringup'

setup(
    name=name,
    version='0.1.0',
    description='Launch files, configuration and the supervisor of the graph.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_bringup']),
        ('share/mount_bringup', ['package.xml', 'README.md']),
        ('share/mount_bringup/launch', glob('launch/*.py')),
        ('share/mount_bringup/config', glob('config/*')),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
    entry_points={
        'console_scripts': [
            'mount_supervisor = mount_ros.start:main',
        ]
    },
)
