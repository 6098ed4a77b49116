"""The recordings of an order: read, told apart, looked at, and none of them twice."""

from collections.abc import Sequence
from pathlib import Path

from engine_mount.identification.friction.files import read_recording
from engine_mount.identification.friction.found import Identification, IdentifyOrder
from engine_mount.identification.friction.kind import RAMP, SAWTOOTH, recognised
from engine_mount.identification.friction.looks.cases import case_of
from engine_mount.identification.friction.looks.force_zero import zeroed
from engine_mount.identification.friction.recording import FrictionRecording, IdentificationError
from engine_mount.recordings.place import recording_hash

STEPS = ('auto', 'ramp', 'sawtooth', 'ladder')


def check_order(order: IdentifyOrder) -> None:
    """Raise `IdentificationError` for an order that contradicts itself."""
    if order.step not in STEPS:
        raise IdentificationError(f'--step {order.step!r} must be one of {", ".join(STEPS)}')
    if order.pairs and (order.train or order.held_out):
        raise IdentificationError(
            '--file tries all pairs of its files; give it alone, or --train and --held-out'
        )
    if not order.pairs and not order.train:
        raise IdentificationError(
            '0 recordings to train with; give --train FILE..., or --file FILE... for all pairs'
        )
    both = {each.resolve() for each in order.train} & {each.resolve() for each in order.held_out}
    if both:
        raise IdentificationError(
            f'{sorted(both)[0].name} is among --train and --held-out; a held-out recording must be unseen: '
            'leave it out on one side'
        )


def taken(
    found: Identification, paths: Sequence[Path], part: str, order: IdentifyOrder
) -> list[tuple[FrictionRecording, str]]:
    """Return the recordings with their kinds; hash, first look, cases and notes go into `found`."""
    result = []
    for path in paths:
        recording = read_recording(path, order.mapping, order.clamp)
        kind = recognised(recording)
        if order.step in (RAMP, SAWTOOTH) and part == 'train':
            _check_kind(recording.name, kind, order.step)
        key = path.name if path.name not in found.recordings else str(path)
        digest = recording_hash(path)
        _check_unseen(found, key, digest)
        found.recordings[key] = {'part': part, 'kind': kind, 'sha256': digest}
        if kind != RAMP:
            recording, look = zeroed(recording, order.zero)
            found.looks[key] = look
            case = case_of(recording, look)
            found.cases += [case] if case else []
        found.notes += [f'{recording.name}: {note}' for note in recording.notes]
        result.append((recording, kind))
    return result


def _check_unseen(found: Identification, key: str, digest: str) -> None:
    for other, entry in found.recordings.items():
        if entry['sha256'] == digest:
            raise IdentificationError(
                f'{key} and {other} ({entry["part"]}) are the same to the bit; a held-out recording must be '
                'unseen, and none counts twice: give each recording once'
            )


def _check_kind(name: str, kind: str, step: str) -> None:
    if kind != step and not (step == SAWTOOTH and kind == RAMP):
        raise IdentificationError(
            f'{name} looks like {kind}, not like {step}; leave --step to auto, or choose another file'
        )
