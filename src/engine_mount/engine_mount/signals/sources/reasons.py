"""Why a store did not give what was asked: whether it may be different later, and what would help."""

from engine_mount.signals.sources.uris import scheme_of

_LASTING = (FileNotFoundError, NotADirectoryError, IsADirectoryError, PermissionError, ValueError, TypeError)
_REFUSED = {  # exceptions of the libraries below fsspec, by name: they are not loaded here
    'DefaultCredentialsError', 'HostKeyNotVerifiable', 'KeyEncryptionError', 'KeyImportError',
    'NoCredentialsError', 'PartialCredentialsError', 'PermissionDenied', 'ProfileNotFound',
    'ClientConnectorCertificateError', 'SFTPPermissionDenied',
}  # fmt: skip
_PASSING_STATUS = (408, 425, 429)  # HTTP: too slow, too early, too often
_HOST_KEY = 'HostKeyNotVerifiable'


def is_lasting(error: BaseException) -> bool:
    """Return whether asking again would give the same: not found, not permitted, not understood."""
    error = _inner(error)
    status = _status(error)
    if status is not None:
        return 400 <= status < 500 and status not in _PASSING_STATUS
    return isinstance(error, _LASTING) or _is_refusal(error)


def told(error: BaseException) -> str:
    """Return the reason in one line."""
    error = _inner(error)
    if isinstance(error, FileNotFoundError) or _status(error) in (404, 410):
        return 'nothing of this name is there'
    if isinstance(error, TimeoutError) and not str(error):
        return 'no answer in time'
    words = ' '.join(str(error).split())
    return f'{type(error).__name__}: {words}' if words else type(error).__name__


def remedy(error: BaseException, uri: str) -> str:
    """Return what would help, for an error about `uri`."""
    error = _inner(error)
    if type(error).__name__ == _HOST_KEY:
        return 'connect once with ssh, check the key of the host and keep it in ~/.ssh/known_hosts'
    if isinstance(error, PermissionError) or _status(error) in (401, 403) or _is_refusal(error):
        return _KEYS[scheme_of(uri)]
    if is_lasting(error):
        return 'engine-mount ls tells what lies in a folder'
    return 'is the store reachable from here?'


_KEYS = {
    's3': "who reads stands in ~/.aws, in AWS_PROFILE or AWS_ACCESS_KEY_ID, or in fsspec's configuration",
    'gs': 'gcloud auth application-default login, or GOOGLE_APPLICATION_CREDENTIALS, says who reads',
    'sftp': 'ssh to this host must work without a question: a key in the agent or in ~/.ssh/config',
    'ssh': 'ssh to this host must work without a question: a key in the agent or in ~/.ssh/config',
    'http': "what the server wants to know stands in fsspec's configuration, as client_kwargs of http",
    'https': "what the server wants to know stands in fsspec's configuration, as client_kwargs of http",
    'memory': '',
    'file': '',
}


def _inner(error: BaseException) -> BaseException:
    """Return what lies behind a `not found`: HTTP of fsspec calls so whatever went wrong on the way."""
    cause = error.__cause__
    if not isinstance(error, FileNotFoundError) or cause is None:
        return error
    broken = isinstance(cause, (ConnectionError, TimeoutError)) or type(cause).__module__.startswith(
        'aiohttp'
    )
    return cause if broken else error


def _status(error: BaseException) -> int | None:
    """Return the status of an answer by HTTP, None where the error is none of an answer."""
    value = getattr(error, 'status', None) or getattr(error, 'code', None)
    try:
        number = int(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return None
    return number if 400 <= number < 600 else None


def _is_refusal(error: BaseException) -> bool:
    names = {kind.__name__ for kind in type(error).__mro__}
    return bool(names & _REFUSED) or str(error).startswith('Forbidden')  # of gcsfs
