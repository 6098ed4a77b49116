"""The compiled walk through the records of a chunk that finds messages, or picks wanted numbers of them."""

from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from mount_models.arithmetic.compiled import compiled

LOG_TIME_PLACE = 15
"""Byte of a message record at which its log time begins: behind opcode, length, channel and sequence."""
WORD = 8
"""Bytes that are picked from each place, as one whole number, the lowest byte first."""
_MESSAGE = int(Opcode.MESSAGE)
_HEAD = 9  # bytes: opcode and length of what follows
_SHORTEST = 22  # bytes behind the head of a message record without payload


class Wanted(NamedTuple):
    """What is picked of the messages of n topics.

    `channels` (n,); `begins` (n + 1, 2): where in `alike` and in `places` those of a topic begin, and at last
    their ends. Each message of a topic has as many bytes as its part of `alike`, and what stands there in
    those that are `marked` (255, else 0); `places` are bytes of its record.
    """

    channels: NDArray[np.int64]
    begins: NDArray[np.int64]
    alike: NDArray[np.uint8]
    marked: NDArray[np.uint8]
    places: NDArray[np.int64]


@compiled
def take(data, ends, first, limit, channels, begins, alike, marked, places, columns, filled):
    """Fill `columns` from `filled` on with the messages in chunks; return how many chunks are taken then.

    `data[:ends[-1]]` are the bytes of chunks, each records from first to last, the end of each in `ends`; of
    these the `first` are taken already. Then follow the parts of `Wanted`. What stands at the places of a
    topic are its rows of `columns`, (n, places, messages); of these `filled`, (n,), are taken. It ends with
    the chunk with which a topic has `limit` messages, or before one with another message or with what are no
    whole records.
    """
    counts = filled.copy()
    for chunk in range(first, len(ends)):
        begin = ends[chunk - 1] if chunk > 0 else 0
        content = data[begin : ends[chunk]]
        if not _take_one(content, channels, begins, alike, marked, places, columns, counts):
            return chunk
        filled[:] = counts
        if counts.max() >= limit:
            return chunk + 1
    return len(ends)


@compiled
def _take_one(data, channels, begins, alike, marked, places, columns, counts):
    """Take the messages of one chunk behind the `counts` that are there; return False if one is another."""
    position, size = 0, len(data)
    while position + _HEAD <= size:
        told = _length(data, position)
        if told < 0:
            return False
        if data[position] == _MESSAGE:
            channel = _channel(data, position)
            for topic in range(len(channels)):
                if channels[topic] != channel:
                    continue
                begin, end = begins[topic, 0], begins[topic + 1, 0]
                payload = data[position + _HEAD + _SHORTEST : position + _HEAD + told]
                if not _is_alike(payload, alike[begin:end], marked[begin:end]):
                    return False
                begin, end = begins[topic, 1], begins[topic + 1, 1]
                for index in range(end - begin):
                    place = position + places[begin + index]
                    columns[topic, index, counts[topic]] = _number(data[place : place + WORD])
                counts[topic] += 1
        position += _HEAD + told
    return position == size


@compiled
def find(data, ends, wanted):
    """Return how many chunks were walked through, and where in `data` their wanted messages begin, rising.

    `data[:ends[-1]]` are the bytes of chunks, the end of each in `ends`; `wanted` tells by number of channel.
    It ends before a chunk that is not records from first to last.
    """
    found = np.empty((ends[-1] if len(ends) else 0) // (_HEAD + _SHORTEST), np.int64)
    count = 0
    for chunk in range(len(ends)):
        position, end, counted = ends[chunk - 1] if chunk > 0 else 0, ends[chunk], count
        content = data[:end]
        while position + _HEAD <= end:
            told = _length(content, position)
            if told < 0:
                return chunk, found[:counted]
            if data[position] == _MESSAGE and wanted[_channel(data, position)]:
                found[count] = position
                count += 1
            position += _HEAD + told
        if position != end:
            return chunk, found[:counted]
    return len(ends), found[:count]


@compiled
def _length(data, position):
    """Return how many bytes stand behind the head of the record at `position`, -1 if that is none."""
    told = np.int64(data[position + 1]) | np.int64(data[position + 2]) << 8
    told |= np.int64(data[position + 3]) << 16 | np.int64(data[position + 4]) << 24
    longer = data[position + 5] | data[position + 6] | data[position + 7] | data[position + 8]
    if longer or told > len(data) - position - _HEAD:
        return -1
    if data[position] == _MESSAGE and told < _SHORTEST:
        return -1
    return told


@compiled
def _channel(data, position):
    """Return the number of the channel of the message at `position`."""
    return np.int64(data[position + 9]) | np.int64(data[position + 10]) << 8


@compiled
def _is_alike(payload, alike, marked):
    if len(payload) != len(alike):
        return False
    differing = np.uint8(0)
    for index in range(len(payload)):  # without a branch, so that several are looked at at once
        differing |= (payload[index] ^ alike[index]) & marked[index]
    return differing == 0


@compiled
def _number(word):
    """Return the whole number in 8 bytes."""
    number = np.int64(0)
    for byte in range(WORD):
        number |= np.int64(word[byte]) << (8 * byte)
    return number
