"""Addresses: what is a URI, what is refused, what is told of one."""

import pytest

from engine_mount.signals.sources.stores import entries, fetched
from engine_mount.signals.sources.uris import SourceError, checked, inside, is_uri, name_of, scheme_of, shown

SECRET = 'hunter2'
WITH_SECRETS = [
    f'sftp://driver:{SECRET}@host/drives/a.mcap',
    f'sftp://driver:{SECRET}@host',
    f's3://key:{SECRET}@bucket/a.mcap',
    f's3://bucket/a.mcap?X-Amz-Signature={SECRET}',
    f'https://host/a.mcap?X-Amz-Signature={SECRET}&X-Amz-Date=1',
    f'https://host/a.mcap?name=a&token={SECRET}',
    f'HTTPS://driver:{SECRET}@host/a.mcap',
]


def test_a_uri_begins_with_a_scheme_and_all_else_is_a_path():
    assert all(map(is_uri, ('s3://bucket/a.mcap', 'file:///a', 'SFTP://host/a')))
    assert not any(map(is_uri, ('bags/first', '/data/a.mcap', 'C:/data', 's3:/bucket/a', 'a b://c', '')))


@pytest.mark.parametrize('uri', WITH_SECRETS)
def test_a_uri_that_holds_a_secret_is_refused_and_the_secret_is_not_told(uri):
    with pytest.raises(SourceError, match='leave it out') as refusal:
        checked(uri)
    assert SECRET not in str(refusal.value)
    with pytest.raises(SourceError, match='leave it out'):
        fetched(uri)


@pytest.mark.parametrize('uri', ['sftp://driver@host/a', 's3://bucket/a?versionId=3', 'https://host/a?id=7'])
def test_a_name_of_a_user_and_a_version_are_no_secrets(uri):
    assert checked(uri) == uri


def test_an_unknown_scheme_is_refused_with_those_that_are_known():
    with pytest.raises(SourceError, match=r'ftp://.*known are file://, s3://, sftp://'):
        scheme_of('ftp://host/a.mcap')


def test_what_is_told_of_a_uri_has_no_query():
    assert shown('https://driver:x@host/a?token=y') == 'https://driver@host/a?...'
    assert shown('s3://bucket/a b.mcap') == 's3://bucket/a b.mcap'


def test_a_local_copy_is_called_as_the_file_in_the_store():
    assert name_of('s3://bucket/drives/a.mcap?versionId=3') == 'a.mcap'
    assert name_of('https://host/a%20b.mcap?id=7') == 'a b.mcap'
    assert name_of('sftp://host/what?.mcap') == 'what?.mcap'
    assert name_of('gs://bucket/run/') == 'run'


def test_what_lies_in_a_folder_keeps_the_query_at_its_end():
    assert inside('https://host/run?id=7', 'a/b.mcap') == 'https://host/run/a/b.mcap?id=7'
    assert inside('s3://bucket/run/', 'a.mcap') == 's3://bucket/run/a.mcap'


def test_a_plain_path_and_a_file_uri_are_read_where_they_lie(tmp_path):
    file = tmp_path / 'a b.mcap'
    file.write_bytes(b'abc')
    assert fetched(str(file)) == fetched(file.as_uri()) == file
    assert [entry.size for entry in entries(str(tmp_path))] == [3]
    with pytest.raises(SourceError, match='no such file'):
        fetched(str(tmp_path / 'b'))
    with pytest.raises(SourceError, match='three slashes'):
        fetched(f'file://data/{file}')
