"""Whatever stands in a file of a user: it is what it says, or is refused in a sentence."""

import contextlib
import math
import random

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mount_models.damper import damper_curve
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import ParameterError
from mount_models.specimen import DEFAULT_SPECIMEN, SpecimenError, specimen_from_mapping

SEEDS = st.integers(0, 1 << 62)
WHOLE = DEFAULT_SPECIMEN.read_text(encoding='utf-8')
SPECIMEN = (
    WHOLE[: WHOLE.index('provenance:')]
    + """provenance:
  written_by: engine-mount identify
  parts:
    force_law:
      specimen: default
      date: '2026-11-21T11:33:22+00:00'
      versions: {mount_bringup: 0.1.0, numpy: 2.4.6}
      recordings:
      - {file: force.csv, sha256: 51ce469172c434356b0f4f9fc0cb23fb9dd6054299591a17d75b0d5cf03aa381}
      points: 885
      residuals: {relative_rms: 0.002593, rms_by_gap: [0.7665, 0.5628]}
      covariance:
      - [452.8, -3.462]
"""
)
"""The shipped specimen with a short provenance: a long one takes most of the time to read."""
PIECES = (
    '&a ',
    '*a',
    '<<: ',
    '!!int ',
    '2026-05-04: ',
    '- ',
    '{',
    '[',
    '"',
    "'",
    ': ',
    '.inf',
    '.nan',
    '1e300',
    '-',
    '9' * 30,
)
PIECES += ('true', 'null', '\n', '\t', ' ', '\0', '\ud800', '# ')


def changed(text, seed):
    draw = random.Random(seed)
    for _ in range(draw.choice((1, 1, 2, 5))):
        first, length = draw.randrange(len(text)), draw.randrange(60)
        piece = draw.choice((*PIECES, text[draw.randrange(len(text)) :][: draw.randrange(60)]))
        text = text[:first] + piece + text[first + draw.choice((0, length)) :] or ' '
    return text


@pytest.mark.filterwarnings('error::RuntimeWarning')
@given(SEEDS)
@example(588181)  # a gap curve that overflows
def test_a_changed_specimen_is_refused_or_all_of_its_numbers_are_finite(seed):
    with contextlib.suppress(SpecimenError, YamlError):
        specimen = specimen_from_mapping(plain_yaml(changed(SPECIMEN, seed)))
        assert math.isfinite(specimen.turns_area * specimen.spring_stiffness * specimen.pad_stiffness)


@given(SEEDS)
def test_a_changed_damper_is_refused_or_opposes_motion(seed):
    text = changed('{velocity: [0, 0.01, 0.05, 0.2], force: [0, 20, 60.5, 90]}', seed)
    with contextlib.suppress(ParameterError):
        assert damper_curve(text).table.min() >= 0.0
