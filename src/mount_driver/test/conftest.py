"""What the tests share:  a multicast group of their own, and the far end of the bus."""

import itertools
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from ros_testing import free_domain

# The tests are imported one by one (importmode importlib); what they share is found by this path.
sys.path.insert(0, str(Path(__file__).parent))

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
def make_car() -> Iterator[Callable[..., Any]]:
    """Return a function that makes a `Car` with some parameters."""
    from car import Car

    made: list[Car] = []

    def make(**parameters: Any) -> Car:
        made.append(Car(**parameters))
        return made[-1]

    yield make
    for each in made:
        each.exchange.stop()
        each.far.close()


@pytest.fixture
def car(make_car: Callable[..., Any]) -> Any:
    """Return a car whose first samples were answered with 3 A."""
    from car import GOOD

    made = make_car()
    made.drive(GOOD, made.answer)
    return made
