"""What the tests share: a multicast group of their own, and the far end of the bus."""

import itertools
import os
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from car import GOOD, Car
from ros_testing import free_domain

_EACH = 40  # ports


@pytest.fixture(scope='session')
def ports() -> Iterator[Iterator[int]]:
    """Give UDP ports that nobody else on this machine has, above those that the kernel gives to anybody.

    A socket hears every group of its port that anyone on this machine has joined; so each process has ports
    of its own, by the ROS domain that it holds.
    """
    with free_domain() as domain:
        first = 61_000 + _EACH * domain
        yield itertools.cycle(range(first, first + _EACH))


@pytest.fixture
def multicast(ports: Iterator[int]) -> tuple[str, int]:
    """Return a multicast group of this process and a port of this test."""
    process = os.getpid()
    return f'239.74.{process >> 8 & 0xFF}.{process & 0xFF}', next(ports)


@pytest.fixture
def make_car() -> Iterator[Callable[..., Car]]:
    """Return a function that makes a `Car` with some parameters."""
    made: list[Car] = []

    def make(**parameters: Any) -> Car:
        made.append(Car(**parameters))
        return made[-1]

    yield make
    for each in made:
        each.exchange.stop()
        each.far.close()


@pytest.fixture
def car(make_car: Callable[..., Car]) -> Car:
    """Return a car whose first samples were answered with 3 A."""
    made = make_car()
    made.drive(GOOD, made.answer)
    return made
