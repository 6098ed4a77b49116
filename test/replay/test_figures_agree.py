"""Terminal, JSON, audit and report tell the same figures of a drive, of a good one and of a bad one."""

import json
import re
import shutil
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from command_line import command

import engine_mount
from engine_mount.drives import drive as driving
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.cdr import string_message

REPOSITORY = Path(__file__).resolve().parents[2]
BENCH = (
    '--core', '--scenario', 'bench', '--duration', '0.8', '--set', 'mount_sim.timeline.start=2.8',
)  # fmt: skip
SHARED = (
    'samples', 'lost_samples', 'lost_messages', 'asked_samples', 'unanswered_samples', 'late_samples',
    'misdated_messages', 'faults',
)  # fmt: skip
STALLED = range(3100, 3326)  # samples without an answer of control
LOST = range(3400, 3405)
FAULTS = {3050 + 40 * number: f'fault number {number}' for number in range(7)}


class Told(NamedTuple):
    """What the commands say of one drive."""

    terminal: str
    summary: dict[str, Any]
    audit: dict[str, Any]
    audited: str
    report: str


def spoiled(folder: Path) -> None:
    """Take samples and answers out of a recording, and add marks of faults."""
    whole = engine_mount.open(folder)
    messages = {
        name: (series.type, list(zip(series.receive_times.tolist(), series.payloads, strict=True)))
        for name, series in ((name, whole[name]) for name in whole)
    }
    first = int(whole['displacement'].receive_times[0])
    shutil.rmtree(folder)
    writer = BagWriter(folder)
    for name, (kind, rows) in messages.items():
        writer.add_topic(name, kind)
        answers, measures = ('/current_setpoint', '/control_trace'), ('/displacement', '/coil_ripple')
        for time, payload in rows:
            number = (time - first) // 1_000_000
            stalled = number in STALLED and name in answers and time > first
            if not (stalled or (number in LOST and name in answers + measures)):
                writer.write(name, bytes(payload), time)
    for number, words in FAULTS.items():
        mark = string_message(f'{{kind: fault, text: {words}}}')
        writer.write('/event', mark, first + number * 1_000_000)
    writer.close()


def words_of(text: str) -> str:
    return ' '.join(text.replace('│', ' ').split())


def told(folder: Path, *options: str, code: int = 0) -> Told:
    drove = command(
        'drive', *BENCH, '--out', folder, '--json', folder.with_suffix('.json'), *options, codes=(code,)
    )
    audit_file = folder.with_suffix('.audit')
    audited = command('audit', folder / 'recording', '--json', audit_file, codes=(code,))
    page = (folder / 'report.html').read_text(encoding='utf-8')
    page = re.sub(r'<script.*?</script>', ' ', page, flags=re.DOTALL)
    summary = json.loads((folder / 'summary.json').read_text())
    assert json.loads(folder.with_suffix('.json').read_text()) == summary
    audit = json.loads(audit_file.read_text())
    return Told(words_of(drove), summary, audit, words_of(audited), words_of(re.sub(r'<[^>]+>', ' ', page)))


@pytest.fixture(scope='module')
def good(tmp_path_factory) -> Told:
    return told(tmp_path_factory.mktemp('good') / 'run')


@pytest.fixture(scope='module')
def bad(tmp_path_factory) -> Told:
    """The same drive, of which the recording was spoiled before anybody looked at it."""
    drive = driving.drive

    def drive_and_spoil(**options):
        driven = drive(**options)
        spoiled(driven.recording)
        return driven

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(driving, 'drive', drive_and_spoil)
        return told(tmp_path_factory.mktemp('bad') / 'run', code=1)


def test_a_good_drive_ends_with_0_and_nothing_to_name(good):
    assert {name: good.summary[name] for name in SHARED} == {
        'samples': 3600,
        'lost_samples': 0,
        'lost_messages': 0,
        'asked_samples': 850,
        'unanswered_samples': 0,
        'late_samples': None,
        'misdated_messages': 0,
        'faults': [],
    }


def test_a_bad_drive_ends_with_1_and_names_what_was_bad(bad):
    assert {name: bad.summary[name] for name in SHARED if name != 'faults'} == {
        'samples': 3600,
        'lost_samples': len(LOST),
        'lost_messages': 2 * len(LOST),
        'asked_samples': 850 - len(LOST),
        'unanswered_samples': len(STALLED),
        'late_samples': None,
        'misdated_messages': 0,
    }
    sentences = [fault['sentence'] for fault in bad.summary['faults']]
    assert sentences[2] == 'no setpoint in time for 227 ms (limit 20 ms): the coil went to 0 A'
    assert sentences[:2] + sentences[3:] == list(FAULTS.values())
    assert [fault['time_s'] for fault in bad.summary['faults']][:4] == pytest.approx(
        [3.05, 3.09, 3.099, 3.13]
    )
    assert 'note faults: 8, the first at 3.050 s fault number 0' in bad.terminal


@pytest.mark.parametrize('kind', ['good', 'bad'])
def test_all_tell_the_same(kind, request):
    found: Told = request.getfixturevalue(kind)
    assert {name: found.audit[name] for name in SHARED} == {name: found.summary[name] for name in SHARED}
    lost, unanswered, faults = (
        re.search(pattern, found.audited)[1]
        for pattern in (
            r'samples lost: (\d+ of \d+(?: \(\d+ messages of all topics\))?)',
            r'samples unanswered: (\d+ of \d+ while control was active)',
            r'faults: (not judged: core has no watches|\d+: .*; \d+ more)',
        )
    )
    for words in (f'samples lost {lost}', f'samples unanswered {unanswered}', f'faults {faults}'):
        assert words in found.terminal
        assert words in found.report
    peak = found.summary['peak_current_a']
    assert f'peak current {peak:.2f} A' in found.terminal
    assert f'peak current {peak:.3g} A' in found.report


def test_the_page_lists_every_figure_of_a_drive_in_its_order(good):
    page = (REPOSITORY / 'docs/reference/recordings.md').read_text()
    section = page.split('\n## Figures\n')[1].split('\n## ')[0]
    assert re.findall(r'^\| `(\w+)` \|', section, flags=re.MULTILINE) == list(good.summary)


def test_switching_is_told_on_the_same_axis(good):
    on = good.summary['switch_on_s'][0]
    assert on > good.summary['excitation_start_s'] == 2.8
    assert f'damping switched on from {on:.2f} s to the end' in good.terminal
    assert f'damping on on (s) off (s) lasted highest displacement highest current {on:.3f}' in good.report


def test_control_that_was_late_for_the_excitation_is_a_complaint(good, tmp_path):
    assert good.summary['control_from_s'] == pytest.approx(2.75, abs=0.1)
    late = command(
        'drive', '--core', '--scenario', 'bench', '--duration', '1.5', '--no-report',
        '--set', 'mount_sim.timeline.start=2', '--out', tmp_path / 'run', codes=(1,),
    )  # fmt: skip
    begin = json.loads((tmp_path / 'run/summary.json').read_text())['control_from_s']
    assert f'control from {begin:.2f} s on' in words_of(late)
    assert f'its first sample {begin - 2.0:.1f} s after the excitation began (limit 0.5 s)' in words_of(late)


@pytest.mark.parametrize('mount', ['hydro', 'friction_off'])
def test_a_mount_in_which_control_can_do_nothing_has_no_figures_of_friction(tmp_path, mount):
    found = told(tmp_path / 'run', '--mount', mount)
    figures = ('control_from_s', 'switch_on_s', 'switch_off_s', 'peak_current_a', 'tracking_error_rms')
    assert [found.summary[name] for name in figures] == [None] * 5
    assert 'friction not applicable: ' in found.terminal
    for words in ('damping switched', 'peak current', 'friction force error'):
        assert words not in found.terminal
    for words in ('damping switched on', 'peak current', 'friction force error'):
        assert f'{words} not applicable: ' in found.report
    assert 'rms error while damping is on' not in found.report
