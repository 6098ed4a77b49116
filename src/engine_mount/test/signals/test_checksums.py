"""Checksums that stores tell of: which are of the whole content, and which only look so."""

import base64
import hashlib
import zlib

import pytest

from engine_mount.signals.sources.checksums import Digest, hash_of, of_info, of_s3

CONTENT = b'what lies in the store'
MD5 = hashlib.md5(CONTENT).hexdigest()
SHA256 = hashlib.sha256(CONTENT)
CRC32 = zlib.crc32(CONTENT).to_bytes(4, 'big')
TAG = {'ETag': f'"{MD5}"'}


def base64_of(data):
    return base64.b64encode(data).decode()


@pytest.mark.parametrize(
    ('head', 'digest'),
    [
        (TAG, Digest('md5', MD5)),
        ({**TAG, 'ServerSideEncryption': 'AES256'}, Digest('md5', MD5)),
        ({**TAG, 'ServerSideEncryption': 'aws:kms'}, None),
        ({**TAG, 'SSECustomerAlgorithm': 'AES256'}, None),
        ({'ETag': f'"{MD5}-3"'}, None),
        ({}, None),
        ({**TAG, 'ChecksumSHA256': base64_of(SHA256.digest())}, Digest('sha256', SHA256.hexdigest())),
        ({'ETag': f'"{MD5}-3"', 'ChecksumCRC32': base64_of(CRC32)}, Digest('crc32', CRC32.hex())),
        ({'ETag': f'"{MD5}-3"', 'ChecksumSHA256': f'{base64_of(SHA256.digest())}-3'}, None),
        (
            {
                'ETag': f'"{MD5}-3"',
                'ChecksumSHA256': base64_of(SHA256.digest()),
                'ChecksumType': 'COMPOSITE',
            },
            None,
        ),
    ],
)
def test_of_an_object_a_stored_checksum_counts_else_the_tag_where_it_is_one(head, digest):
    assert of_s3(head) == digest
    if digest is not None:
        hashed = hash_of(digest.algorithm)
        hashed.update(CONTENT[:5])
        hashed.update(CONTENT[5:])
        assert hashed.hexdigest() == digest.value


@pytest.mark.parametrize(
    ('info', 'digest'),
    [
        ({'md5Hash': base64_of(bytes.fromhex(MD5))}, Digest('md5', MD5)),
        ({'Content-MD5': base64_of(bytes.fromhex(MD5))}, Digest('md5', MD5)),
        (
            {'Digest': f'md5=x,SHA-256={base64_of(SHA256.digest())}'},
            Digest('sha256', SHA256.hexdigest()),
        ),
        ({'ETag': MD5}, None),
        ({'md5Hash': 'no base64'}, None),
        ({'md5Hash': base64_of(b'short')}, None),
    ],
)
def test_of_google_and_by_http_only_what_is_called_a_checksum_is_one(info, digest):
    assert of_info(info) == digest
