"""What a store says of the content of a file, and whether what came has it."""

import base64
import binascii
import hashlib
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

_MD5_TAG = re.compile(r'"?([0-9a-f]{32})"?')
_S3_NAMES = {'ChecksumSHA256': 'sha256', 'ChecksumSHA1': 'sha1', 'ChecksumCRC32': 'crc32'}
_OTHER_KEYS = ('aws:kms', 'aws:kms:dsse')  # with these the tag is no MD5 of the content


@dataclass(frozen=True)
class Digest:
    """A checksum: its algorithm, one of sha256, sha1, md5, crc32, and its value in hexadecimal digits."""

    algorithm: str
    value: str


class Hash(Protocol):
    """What takes the bytes of a file one after another."""

    def update(self, data: bytes, /) -> None:
        """Take more bytes."""

    def hexdigest(self) -> str:
        """Return the checksum so far."""


def hash_of(algorithm: str) -> Hash:
    """Return an empty hash."""
    return _Crc32() if algorithm == 'crc32' else hashlib.new(algorithm, usedforsecurity=False)


def of_s3(head: Mapping[str, Any]) -> Digest | None:
    """Return the checksum in the answer to HeadObject: a stored one, else the tag where it is the MD5."""
    if head.get('ChecksumType', 'FULL_OBJECT') == 'FULL_OBJECT':
        for name, algorithm in _S3_NAMES.items():
            if found := _of_base64(algorithm, head.get(name, '')):  # of an upload in parts: ends in -<number>
                return found
    encrypted = head.get('ServerSideEncryption') in _OTHER_KEYS or 'SSECustomerAlgorithm' in head
    tag = _MD5_TAG.fullmatch(head.get('ETag', ''))
    return Digest('md5', tag[1]) if tag and not encrypted else None


def of_info(info: Mapping[str, Any]) -> Digest | None:
    """Return the checksum in what fsspec tells of a file of Google's store or by HTTP, None without one."""
    for part in str(info.get('Digest', '')).split(','):
        name, _, value = part.strip().partition('=')
        if name.lower() == 'sha-256' and (found := _of_base64('sha256', value)):
            return found
    return _of_base64('md5', str(info.get('md5Hash') or info.get('Content-MD5') or ''))


def _of_base64(algorithm: str, text: str) -> Digest | None:
    length = len(hash_of(algorithm).hexdigest())
    try:
        value = base64.b64decode(text, validate=True).hex()
    except (binascii.Error, ValueError):
        return None
    return Digest(algorithm, value) if len(value) == length else None


class _Crc32:
    def __init__(self) -> None:
        self._value = 0

    def update(self, data: bytes, /) -> None:
        self._value = zlib.crc32(data, self._value)

    def hexdigest(self) -> str:
        return f'{self._value:08x}'
