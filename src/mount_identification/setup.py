from setuptools import find_packages, setup

name = 'mount_identification'

setup(
    name=name,
    version='0.1.0',
    description='From recordings of a rack or a drive to the parameters of a specimen.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_identification']),
        ('share/mount_identification', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
)
