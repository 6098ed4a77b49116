"""What stands in a recording beside its messages and is no account of it: records of others, attachments."""

import hashlib
from collections.abc import Iterable
from dataclasses import replace

from mount_bags.piece_topics import ACCOUNTS, BagFile
from mount_bags.verbatim import VerbatimBag


def copy_beside_messages(files: Iterable[BagFile], bag: VerbatimBag) -> None:
    """Copy it from `files` to `bag`, what is equal once; what is lost of it, `BagFile.lost_beside` tells."""
    records: list[tuple[str, dict[str, str]]] = []
    attached: set[bytes] = set()
    for file in files:
        for entry in file.records:
            if entry[0] not in ACCOUNTS and entry not in records:
                records.append(entry)
                bag.add_record(*entry)
        for attachment in file.attachments():
            content = hashlib.sha256(attachment.data).digest() + repr(replace(attachment, data=b'')).encode()
            if content not in attached:
                attached.add(content)
                bag.add_attachment(attachment)
