from setuptools import find_packages, setup

name = 'mount_init'

setup(
    name=name,
    version='0.1.0',
    description='Air gap and current-force table of the engine mount, estimated at each activation.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_init']),
        ('share/mount_init', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
    entry_points={'console_scripts': ['mount_init = mount_ros.start:main']},
)
