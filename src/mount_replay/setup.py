from setuptools import find_packages, setup

name = 'mount_replay'

setup(
    name=name,
    version='0.1.0',
    description='Drives and replays: without middleware, in lock-step, in real time.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_replay']),
        ('share/mount_replay', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
)
