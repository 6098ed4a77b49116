"""The registered topic behind the name of a recorded one."""

import functools

from mount_ros.topics import RACK_TOPICS, TOPICS, Topic


# Recordings have the same few names, and of each it is asked again and again.
@functools.lru_cache(maxsize=1024)
def registered_topic(name: str, type_name: str) -> Topic | None:
    """Return the registered topic behind a full name with any namespace, None if there is none.

    A topic of another type than `type_name` is a foreign one, whatever its name.
    """
    known = TOPICS + RACK_TOPICS
    fitting = [topic for topic in known if f'/{name}'.endswith('/' + topic.name.lstrip('/'))]
    found = max(fitting, key=lambda topic: len(topic.name), default=None)
    return found if found is not None and found.type == type_name else None
