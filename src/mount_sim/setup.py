from setuptools import find_packages, setup

name = 'mount_sim'

setup(
    name=name,
    version='0.1.0',
    description='The far end of the CAN bus: electronics, actuator, friction contact and vehicle, simulated.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    package_data={name: ['dbc/*.dbc']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_sim']),
        ('share/mount_sim', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
    entry_points={'console_scripts': ['mount_sim = mount_ros.start:main']},
)
