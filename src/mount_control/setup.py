from setuptools import find_packages, setup

name = 'mount_control'

setup(
    name=name,
    version='0.1.0',
    description='Switched, viscous-like friction damping at 1 kHz.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_control']),
        ('share/mount_control', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
    entry_points={'console_scripts': ['mount_control = mount_ros.start:main']},
)
