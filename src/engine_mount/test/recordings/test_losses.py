"""What counts as lost, unanswered, late and as a fault, on small drives whose numbers are known."""

from pathlib import Path

import numpy as np
import pytest
from compared_drives import answers
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from ros_testing import serialised
from samples import PERIOD, RECORDED, START, joint_state

import engine_mount
from engine_mount.recordings.answers import Control, Setpoints, judge_answers, on_one_clock
from engine_mount.recordings.audit import audit
from engine_mount.recordings.losses import as_json, losses, sentences
from engine_mount.recordings.times import NO_TIMES
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.cdr import string_message
from mount_ros.topics import (
    COIL_RIPPLE,
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DIAGNOSTICS,
    DISPLACEMENT,
    EVENT,
)

SAMPLES = START + np.arange(3000) * PERIOD
NO_FRAMES = 'no frames from the electronics for more than 100 ms; are they powered?'


def judged(answered, *, sent=None, samples=SAMPLES, steps=NO_TIMES, handovers=NO_TIMES, inactive=None):
    sent = answered + 300_000 if sent is None else sent
    setpoints, control = Setpoints(answered, sent), (steps, handovers)
    return judge_answers(samples, setpoints, Control(*control, inactive))


# Answers.


def test_samples_are_only_asked_for_while_control_was_active():
    found = judged(np.concatenate([SAMPLES[100:200], SAMPLES[2000:2500]]))
    assert (found.asked, found.unanswered, found.silences) == (600, 0, ())
    assert judged(np.empty(0, np.int64)).asked == 0


def test_the_ramp_and_the_time_until_control_is_active_ask_for_nothing():
    found = judged(np.concatenate([SAMPLES[:300], SAMPLES[400:1000]]), handovers=SAMPLES[299:300])
    assert (found.asked, found.unanswered, found.spans) == (600, 0, ((SAMPLES[400], SAMPLES[999]),))


def test_a_control_that_stalls_leaves_samples_unanswered_and_the_coil_at_0_ampere():
    found = judged(np.delete(SAMPLES, slice(1000, 1398)))
    assert (found.asked, found.unanswered) == (3000, 398)
    assert found.silences == ((SAMPLES[999], SAMPLES[1398]),)


@pytest.mark.parametrize(('missing', 'silent'), [(19, 0), (20, 1)])
def test_the_coil_is_at_0_ampere_after_20_ms_without_a_setpoint(missing, silent):
    found = judged(np.delete(SAMPLES, slice(1000, 1000 + missing)))
    assert (found.unanswered, len(found.silences)) == (missing, silent)


def test_an_answer_that_was_sent_after_20_ms_is_late_and_ends_no_silence():
    sent = SAMPLES + 300_000
    sent[1000:1100] = SAMPLES[1100]  # all at once, the oldest 100 ms late
    found = judged(SAMPLES, sent=sent)
    assert (found.unanswered, found.late) == (0, 80)
    assert found.silences == ((SAMPLES[999], SAMPLES[1080]),)


def test_whether_answers_were_late_is_unknown_in_lock_step():
    assert judged(SAMPLES, sent=SAMPLES + 10**15).late is None


@pytest.mark.parametrize('end', [2000, 3000])
def test_a_long_silence_counts_unless_control_said_that_it_is_inactive(end):
    answered = np.delete(SAMPLES, slice(1000, end))
    silent = end - 1000
    assert judged(answered).unanswered == 0  # nobody tells
    assert judged(answered, inactive=np.empty(0, np.int64)).unanswered == silent
    assert judged(answered, inactive=SAMPLES[1050:1051]).unanswered == 0


def test_damaged_times_that_are_farther_apart_than_any_clock_goes_are_of_another_clock():
    stamps, times = np.array([-(2**62), 0, 2**62]), np.array([2**61, 0, -(2**61)])
    assert not on_one_clock(stamps, times)


# Whole recordings.


def write(
    folder: Path, *, unanswered=range(0), lost=range(0), no_ripple=range(0), no_trace=(), reports=(), marks=()
):
    """Write a drive of 2 s; `reports` are (sample, node, level, sentence, state), `marks` (sample, text)."""
    signals, count = answers(2000), 2000
    writer = BagWriter(folder)
    for topic in (DISPLACEMENT, COIL_RIPPLE, CURRENT_SETPOINT, CONTROL_TRACE, DIAGNOSTICS, EVENT):
        writer.add_topic(f'/{topic.name.lstrip("/")}', topic.type)
    for index in range(count):
        stamp = START + index * PERIOD
        for topic, skipped in (
            (DISPLACEMENT, lost),
            (COIL_RIPPLE, (*lost, *no_ripple)),
            (CURRENT_SETPOINT, (*lost, *unanswered)),
            (CONTROL_TRACE, (*lost, *unanswered, *no_trace)),
        ):
            if index not in skipped:
                numbers = np.full(len(topic.names), signals['displacement'][index])
                numbers[list(topic.names).index('current') if topic is CONTROL_TRACE else 0] += 0.5
                raw = joint_state(stamp, list(topic.names), numbers, np.empty(0))
                writer.write(f'/{topic.name}', raw, stamp + 200_000, stamp + 100_000)
        for sample, *status in reports:
            if sample == index:
                writer.write('/diagnostics', report(*status), stamp + 300_000)
        for sample, mark in marks:
            if sample == index:
                writer.write('/event', string_message(mark), stamp + 400_000)
    writer.close()
    return engine_mount.open(folder)


def report(node: str, level: int, sentence: str, state: str) -> bytes:
    values = [KeyValue(key='state', value=state)]
    status = DiagnosticStatus(level=bytes([level]), name=node, message=sentence, values=values)
    return serialised(DiagnosticArray(status=[status]))


def figures(recording):
    audits = audit(recording)
    return losses(recording, audits), audits


def test_an_unanswered_sample_is_no_lost_message(tmp_path):
    found, audits = figures(write(tmp_path / 'bag', unanswered=range(500, 898)))
    assert (found.lost_samples, found.lost_messages, found.unanswered) == (0, 0, 398)
    assert (audits['/current_setpoint'].lost, audits['/control_trace'].lost) == (0, 0)
    assert [str(fault) for fault in found.faults] == [
        '0.499 s mount_control: no setpoint in time for 399 ms (limit 20 ms): the coil went to 0 A'
    ]
    assert not found.sound
    assert found.lossless


def test_a_lost_sample_counts_once_however_many_of_its_messages_are_missing(tmp_path):
    found, audits = figures(write(tmp_path / 'bag', lost=range(500, 505), no_ripple=range(503, 508)))
    assert (found.lost_samples, found.samples) == (8, 2000)
    assert found.lost_messages == audits['/displacement'].lost + audits['/coil_ripple'].lost == 5 + 8
    assert found.unanswered == 0  # what did not arrive cannot be answered
    assert not found.lossless


def test_a_setpoint_without_its_trace_is_a_lost_message(tmp_path):
    for lost in (range(0), range(700, 704)):
        recording = write(tmp_path / f'{len(lost)}', unanswered=range(100, 103), no_trace=lost)
        assert audit(recording)['/control_trace'].lost == len(lost)


def test_every_error_of_the_drive_is_a_fault_once(tmp_path):
    reports = [
        (10, 'mount_init', 2, 'refused, before control was active', 'inactive'),
        (600, 'mount_driver', 2, NO_FRAMES, 'active'),
        (700, 'mount_driver', 2, NO_FRAMES.replace('100', '200'), 'active'),
        (800, 'mount_driver', 0, 'link is up', 'active'),
        (900, 'mount_driver', 2, NO_FRAMES, 'active'),
        (950, 'mount_control', 0, 'damping off', 'active'),
        (1995, 'mount_control', 0, 'inactive', 'inactive'),
    ]
    marks = [
        (601, f'{{kind: fault, time: {START + 601 * PERIOD}, text: "mount_driver: {NO_FRAMES}"}}'),
        (1200, f'{{kind: fault, time: {START + 1200 * PERIOD}, text: smoke}}'),
        (1300, 'a bump'),
    ]
    found, _ = figures(write(tmp_path / 'bag', unanswered=range(100), reports=reports, marks=marks))
    assert [(round(fault.time, 1), fault.node, fault.sentence) for fault in found.faults] == [
        (0.6, 'mount_driver', NO_FRAMES),
        (0.9, 'mount_driver', NO_FRAMES),
        (1.2, '', 'smoke'),
    ]
    assert found.unanswered == 0


def test_what_nodes_say_after_control_was_deactivated_is_no_fault_of_the_drive(tmp_path):
    reports = [
        (1500, 'mount_control', 0, 'damping off', 'active'),
        (1910, 'mount_control', 0, 'inactive', 'inactive'),
        (1990, 'mount_driver', 2, NO_FRAMES, 'active'),
    ]
    found, _ = figures(write(tmp_path / 'bag', unanswered=range(1900, 2000), reports=reports))
    assert (found.faults, found.unanswered) == ((), 0)


def test_words_and_json_tell_the_same_figures(tmp_path):
    reports = [(600, 'mount_driver', 2, NO_FRAMES, 'active')]
    recording = write(tmp_path / 'bag', unanswered=range(500, 898), lost=range(50, 55), reports=reports)
    found, audits = figures(recording)
    told = as_json(audits, found)
    assert (told['lost_samples'], told['unanswered_samples'], told['asked_samples']) == (5, 398, 1995)
    assert [fault['sentence'] for fault in told['faults']] == [each.sentence for each in found.faults]
    words = ' '.join('\n'.join(sentences(audits, found)).split())
    assert 'samples lost: 5 of 2000 (10 messages of all topics)' in words
    assert 'samples unanswered: 398 of 1995 while control was active' in words
    assert f'faults: 2: 0.499 s mount_control: {found.faults[0].sentence}; 0.600 s mount_driver: ' in words


# Stamps that no sample has.


@pytest.mark.parametrize('stamp', [2_147_483_647_000_000_000, 1, 0, -1_000_000_000_000_000_000])
@pytest.mark.parametrize('topic', [DISPLACEMENT, COIL_RIPPLE, CURRENT_SETPOINT], ids=lambda topic: topic.name)
def test_one_stamp_far_off_is_named_and_is_no_loss(tmp_path, topic, stamp):
    writer = BagWriter(tmp_path / 'bag')
    for each in RECORDED:
        writer.add_topic(f'/{each.name}', each.type)
    for index, time in enumerate(SAMPLES[:1000].tolist()):
        for each in RECORDED:
            told = stamp if each is topic and index == 400 else time
            values = np.zeros(len(each.names))
            raw = joint_state(told, list(each.names), values, values if each.has_derivatives else np.empty(0))
            writer.write(f'/{each.name}', raw, time + 300_000)
    writer.close()
    recording = engine_mount.open(tmp_path / 'bag')
    audits = audit(recording)
    found = losses(recording, audits)
    assert (found.samples, found.lost_samples, found.lost_messages, found.unanswered) == (1000, 0, 0, 0)
    assert audits[f'/{topic.name}'].misdated == found.misdated == 1
    assert not found.sound
    said = '\n'.join(sentences(audits, found))
    assert f'/{topic.name}: stamps misdated: 1, the first {stamp / 1e9:.9f} s of message 401' in said
    assert 'limit 10 s' in said
    assert 'Misdated: 1 messages' in said
    assert recording.time_axis.zero == SAMPLES[0]
