"""With which versions recorded answers were made, and how these differ from those here."""

from collections.abc import Mapping
from typing import Any


def version_differences(session: Mapping[str, Any], here: Mapping[str, str]) -> dict[str, str | None]:
    """Return {what: recorded version} of all that is another one here, None where the session does not tell.

    A recorded replay has its own versions beside those of the drive; its answers are of its own.
    """
    replay = session.get('replay')
    recorded = (replay if isinstance(replay, Mapping) else session).get('versions')
    told = recorded if isinstance(recorded, Mapping) else {}
    versions = {name: str(told[name]) if name in told else None for name in here}
    return {name: version for name, version in versions.items() if version != here[name]}


def versions_sentence(differences: Mapping[str, str | None], here: Mapping[str, str]) -> str:
    """Return the sentence about what `version_differences` found."""
    if not differences:
        return 'the recording was made with the same versions on the same kind of processor'
    others = [f'{name} {old} (here {here[name]})' for name, old in differences.items() if old is not None]
    untold = [name for name, old in differences.items() if old is None]
    if len(untold) == len(here):
        return 'the recording does not tell with which versions and on which processor it was made'
    text = 'the recording was made with '
    text += f'others than here: {", ".join(others)}' if others else 'the same versions as far as it tells'
    return text + (f'; it does not tell {", ".join(untold)}' if untold else '')
