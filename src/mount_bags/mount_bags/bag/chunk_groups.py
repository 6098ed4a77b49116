"""Which topics of a recording share chunks: those that a car has, and all others."""

from mount_bags.messages.series import registered_topic

OF_A_CAR = 0
OF_OTHERS = 1


def chunk_group(name: str, type_name: str) -> int:
    """Return the group of the topic with this full name; one that no registry knows is among the others."""
    topic = registered_topic(name, type_name)
    return OF_OTHERS if topic is None or topic.only_simulated else OF_A_CAR
