from setuptools import find_packages, setup

setup(
    name='engine_mount',
    version='0.1.0',
    description='The desk of the engine mount: recordings, drives, experiments, the engine-mount command.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test', 'test.*']),
    package_data={
        'engine_mount.experiments': ['*.yaml', 'check/*.yaml'],
        'engine_mount.export': ['*.in'],
        'engine_mount.faults': ['faults.yaml'],
        'engine_mount.fleet': ['*.yaml'],
        'engine_mount.reports': ['drawing/browser/*'],
        'engine_mount.view': ['page/*', 'layouts/*'],
    },
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
    entry_points={'console_scripts': ['engine-mount = engine_mount.cli.start:main']},
)
