from setuptools import find_packages, setup

name = 'mount_experiments'

setup(
    name=name,
    version='0.1.0',
    description="The paper's experiments, repeated and told beside what the paper says.",
    license='Apache-2.0',
    packages=find_packages(exclude=['test']),
    package_data={name: ['check/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/mount_experiments']),
        ('share/mount_experiments', ['package.xml', 'README.md']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon knows what passes the tests
)
