from setuptools import find_packages, setup

name = 'mount_recorder'

setup(
    name=name,
    version='0.1.0',
    description='Recording, reading and auditing of drives in rosbag2 MCAP bags.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_recorder']),
        ('share/mount_recorder', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
    entry_points={'console_scripts': ['mount_recorder = mount_recorder.node:main']},
)
