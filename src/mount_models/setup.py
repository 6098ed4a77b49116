from setuptools import find_packages, setup

name = 'mount_models'

setup(
    name=name,
    version='0.1.0',
    description='Physics and laws of the engine mount: actuator, coil, friction, damper.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    package_data={name: ['specimens/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_models']),
        ('share/mount_models', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
)
