"""How the page about a drive judges what the recording lacks."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from engine_mount.recordings.losses import Losses
from engine_mount.reports.sections.section import GOOD, LOOK, UNKNOWN
from engine_mount.reports.sections.verdict import findings

SOUND = Losses(
    samples=1000,
    lost_samples=0,
    lost_messages=0,
    asked=1000,
    unanswered=0,
    late=0,
    misdated=0,
    faults=(),
    whole=True,
)
FACTS = SimpleNamespace(without_friction='no damper', undamped=None, undamped_remark='not asked for')


@pytest.mark.parametrize(
    ('lacking', 'judgement'),
    [
        ({}, GOOD),
        ({'lost_samples': 1, 'lost_messages': 2}, LOOK),
        ({'lost_messages': 1}, LOOK),
        ({'unanswered': 1}, LOOK),
        ({'misdated': 1}, LOOK),
        ({'whole': False}, LOOK),
        ({'lost_samples': None}, GOOD),
        ({'lost_samples': None, 'lost_messages': None}, UNKNOWN),
    ],
)
def test_whatever_is_lost_unanswered_or_misdated_is_to_be_looked_at(lacking, judgement):
    subject = SimpleNamespace(facts=FACTS, losses=replace(SOUND, **lacking))
    judged = {finding.what: finding.judgement for finding in findings(subject)}
    assert judged['Losses'] == judgement
