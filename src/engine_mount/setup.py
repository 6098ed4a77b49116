from setuptools import find_packages, setup

setup(
    name='engine_mount',
    version='0.1.0',
    description='The desk of the engine mount: works on recordings and simulations.',
    license='Apache-2.0',
    packages=find_packages(exclude=['test', 'test.*']),
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
)
