from setuptools import find_packages, setup

name = 'mount_cli'

setup(
    name=name,
    version='0.1.0',
    description='The engine-mount command: one file for each sub-command.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    package_data={name: ['completion/names.json']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_cli']),
        ('share/mount_cli', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
    entry_points={'console_scripts': ['engine-mount = mount_cli.start:main']},
)
