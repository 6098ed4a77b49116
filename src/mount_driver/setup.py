from setuptools import find_packages, setup

name = 'mount_driver'

setup(
    name=name,
    version='0.1.0',
    description='CAN FD link to the electronics of the engine mount.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    package_data={name: ['dbc/*.dbc']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_driver']),
        ('share/mount_driver', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
    entry_points={'console_scripts': ['mount_driver = mount_ros.start:main']},
)
