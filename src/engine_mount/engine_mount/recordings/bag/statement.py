"""What a recorder said of its losses, read from the recording."""

from collections.abc import Mapping

from mount_models.plain_yaml import plain_yaml


def read_statement(record: Mapping[str, str]) -> dict[str, dict[str, int]]:
    """Return {topic: {`received`, `kept`, `lost`, `missing`}} of the record; {} if it is not understood."""
    try:
        topics = plain_yaml(record['topics'])
        return {str(name): {key: int(count) for key, count in row.items()} for name, row in topics.items()}
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        return {}
