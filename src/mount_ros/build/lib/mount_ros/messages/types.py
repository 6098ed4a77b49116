"""Message classes by their full name."""

import importlib


def message_class(name: str) -> type:
    """Return the class of a type such as `sensor_msgs/msg/JointState`; raises `ValueError` if unknown."""
    package, _, kind = name.partition('/msg/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), kind)
    except (ImportError, AttributeError, TypeError, ValueError):
        raise ValueError(f'message type {name!r} is not installed; is its package missing?') from None
