"""Roads and tables that the tests share; a writer of OpenCRG files, made from the description of the format
and from none of the reader's code."""

import struct

import numpy as np
import pytest

from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.roads.iso8608 import RoadProfile
from mount_sim.excitation.road import RandomRoad, random_road

SEPARATOR = '$' * 80


def crg_text(sections, channels, kind, *, virtual=()):
    """The text of a file up to the line before its numbers."""
    lines = ['$CT  ! comment', 'made by a test: Stra\xdfe', '$!' + '*' * 60]
    for keyword, entries in sections.items():
        lines += [f'${keyword}', *(f'{name:<24} = {value}' for name, value in entries.items()), '$']
    lines += ['$KD_Definition  ! what follows', f'#:{kind}', *(f'U:{one}' for one in virtual)]
    lines += [
        *(f'D:{channel}   ! a channel' for channel in channels),
        '$!' + '*' * 60,
        '* l_sec 1',
        SEPARATOR,
    ]
    return '\n'.join(lines) + '\n'


def crg_numbers(table, kind):
    """The bytes of the numbers of `table` (rows, channels) in records of 80 bytes."""
    if kind in ('LRFI', 'LDFI'):
        width, digits = (10, 7) if kind == 'LRFI' else (20, 14)
        lines = []
        for row in table:
            cells = [
                '*missing*'.rjust(width) if np.isnan(number) else f'{number:{width}.{digits}f}'
                for number in row
            ]
            step = 80 // width
            lines += [''.join(cells[at : at + step]) for at in range(0, len(cells), step)]
        return '\n'.join(lines).encode('latin-1') + b'\n'
    letter, size = ('f', 4) if kind == 'KRBI' else ('d', 8)
    numbers = [float(number) for row in table for number in row]
    numbers += [float('nan')] * (-len(numbers) % (80 // size))
    return struct.pack(f'>{len(numbers)}{letter}', *numbers)


@pytest.fixture(scope='session')
def write_crg():
    """A function that writes a file: heights (rows, sections) `increment` apart at lateral places `v`."""

    def write(path, heights, increment, v, kind='LRFI', *, reference=None, named=True, head=None, more=None):
        reference = reference or {}
        road = {
            'REFERENCE_LINE_START_U': 0.0,
            'REFERENCE_LINE_END_U': increment * (len(heights) - 1),
            'REFERENCE_LINE_INCREMENT': increment,
            'LONG_SECTION_V_RIGHT': v[0],
            'LONG_SECTION_V_LEFT': v[-1],
            **({} if named else {'LONG_SECTION_V_INCREMENT': v[1] - v[0]}),
            **(head or {}),
        }
        units = {'phi': 'rad', 'slope': 'm/m', 'banking': 'm/m'}
        channels = [f'reference line {name},{units[name]}' for name in reference]
        sections = [f'at v = {place:.3f}' if named else f'{1 + number}' for number, place in enumerate(v)]
        channels += [f'long section {section},m' for section in sections]
        table = np.column_stack([*reference.values(), heights])
        text = crg_text({'ROAD_CRG': road, **(more or {})}, channels, kind)
        path.write_bytes(text.encode('latin-1') + crg_numbers(table, kind))
        return path

    return write


@pytest.fixture(scope='session')
def made_road():
    """A function that makes a road of known Gd(n0) (m^3) and waviness."""

    def make(roughness=64e-6, waviness=2.0, length=300.0, spacing=0.05, seed=1):
        places = np.arange(0.0, length, spacing)
        shape = RandomRoad(roughness, waviness, 0.005, min(10.0, 0.4 / spacing), 10.0, 0.0, seed)
        height = random_road(places / shape.speed, shape)
        return RoadProfile(0.0, spacing, height, Provenance('made.csv', '', 0, '', ''))

    return make
