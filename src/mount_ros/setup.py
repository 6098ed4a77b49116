from setuptools import find_packages, setup

name = 'mount_ros'

setup(
    name=name,
    version='0.1.0',
    description='What all nodes of the engine mount share: topics, messages, parameters, safe lifecycle.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    package_data={name: ['dds/*.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_ros']),
        ('share/mount_ros', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
)
