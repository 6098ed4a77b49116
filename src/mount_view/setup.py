from setuptools import find_packages, setup

name = 'mount_view'

setup(
    name=name,
    version='0.1.0',
    description='The running graph or a recording, looked at while time goes on.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    package_data={name: ['page/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_view']),
        ('share/mount_view', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
)
