"""Units of a topic's fields in the metadata of its MCAP channel, for topics that no registry knows.

rosbag2 keeps that metadata and passes over names that it does not know.
"""

import json
from collections.abc import Mapping

KEY = 'units'
"""Name of the entry: a JSON object of field and unit, as in {"force": "N"}."""


def units_text(units: Mapping[str, str]) -> dict[str, str]:
    """Return the entries of a channel's metadata that tell `units` by field; none where there are none."""
    return {KEY: json.dumps(dict(units), ensure_ascii=False)} if units else {}
