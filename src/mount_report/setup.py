from setuptools import find_packages, setup

name = 'mount_report'

setup(
    name=name,
    version='0.1.0',
    description='Figures of a drive, pages and pictures about recordings.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    package_data={name: ['drawing/browser/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_report']),
        ('share/mount_report', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
)
