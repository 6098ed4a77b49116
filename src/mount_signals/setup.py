from setuptools import find_packages, setup

name = 'mount_signals'

setup(
    name=name,
    version='0.1.0',
    description='Recordings of others: from any store, in any format, with units and times said.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_signals']),
        ('share/mount_signals', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
)
