"""The compiled walk through the records of a chunk that picks the wanted bytes of one topic's messages."""

import numpy as np
from mcap.opcode import Opcode

from mount_models.arithmetic.compiled import compiled

LOG_TIME_PLACE = 15
"""Byte of a message record at which its log time begins: behind opcode, length, channel and sequence."""
_MESSAGE = int(Opcode.MESSAGE)
_HEAD = 9  # bytes: opcode and length of what follows
_SHORTEST = 22  # bytes behind the head of a message record without payload
_WORD = 8  # bytes that are picked from each place


@compiled
def take(data, channel, shape, places, rows, filled):
    """Fill `rows` from row `filled` on with the messages of a channel; return how many are filled then.

    `data`: bytes of a chunk, records from first to last. Each message has as many bytes as `shape`,
    (2, bytes), and in those that its second row marks (255, else 0) what stands in the first; of its record
    the 8 bytes from each of `places` on are taken. Negative: a message is another, or these are no whole
    records.
    """
    position, size = 0, len(data)
    length = _SHORTEST + shape.shape[1]
    while position + _HEAD <= size:
        told = int(data[position + 1]) | int(data[position + 2]) << 8
        told |= int(data[position + 3]) << 16 | int(data[position + 4]) << 24
        longer = data[position + 5] | data[position + 6] | data[position + 7] | data[position + 8]
        if longer or told > size - position - _HEAD:
            return -1
        if data[position] == _MESSAGE and told < _SHORTEST:
            return -1
        if data[position] == _MESSAGE and int(data[position + 9]) | int(data[position + 10]) << 8 == channel:
            if told != length:
                return -1
            differing = np.uint8(0)
            payload = data[position + _HEAD + _SHORTEST : position + _HEAD + told]
            for index in range(len(payload)):  # without a branch, so that several are looked at at once
                differing |= (payload[index] ^ shape[0, index]) & shape[1, index]
            if differing:
                return -1
            for index in range(len(places)):
                begin = position + places[index]
                for byte in range(_WORD):
                    rows[filled, _WORD * index + byte] = data[begin + byte]
            filled += 1
        position += _HEAD + told
    return filled if position == size else -1
