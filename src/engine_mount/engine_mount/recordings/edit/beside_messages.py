"""What stands in a recording beside its messages and is no account of it: records of others, attachments."""

import hashlib
from collections.abc import Iterable
from dataclasses import replace

from engine_mount.recordings.bag.recording import Recording
from engine_mount.recordings.container.stored import ACCOUNTS
from engine_mount.recordings.edit.verbatim import VerbatimBag


def copy_beside_messages(recordings: Iterable[Recording], bag: VerbatimBag) -> None:
    """Copy it to `bag`, what is equal once; what is damaged shows in `lost_beside_messages` afterwards."""
    records: list[tuple[str, dict[str, str]]] = []
    attached: set[bytes] = set()
    for file in (file for recording in recordings for file in recording.files):
        for entry in file.records:
            if entry[0] not in ACCOUNTS and entry not in records:
                records.append(entry)
                bag.add_record(*entry)
        for attachment in file.attachments():
            content = hashlib.sha256(attachment.data).digest() + repr(replace(attachment, data=b'')).encode()
            if content not in attached:
                attached.add(content)
                bag.add_attachment(attachment)


def lost_beside_messages(recordings: Iterable[Recording]) -> list[str]:
    """Return the names of what stood there and could not be read."""
    return [name for recording in recordings for file in recording.files for name in file.lost_beside]
