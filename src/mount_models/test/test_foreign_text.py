"""Whatever stands in a file of a user: it is what it says, or is refused in a sentence."""

import contextlib
import math
import random

from hypothesis import given
from hypothesis import strategies as st

from mount_models.damper import damper_curve
from mount_models.damper_points import DamperError
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import ParameterError
from mount_models.specimen import DEFAULT_SPECIMEN, SpecimenError, specimen_from_mapping

SEEDS = st.integers(0, 1 << 62)
SPECIMEN = DEFAULT_SPECIMEN.read_text(encoding='utf-8')
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


@given(SEEDS)
def test_a_changed_specimen_is_refused_or_all_of_its_numbers_are_finite(seed):
    with contextlib.suppress(SpecimenError, YamlError):
        specimen = specimen_from_mapping(plain_yaml(changed(SPECIMEN, seed)))
        assert math.isfinite(specimen.turns_area * specimen.spring_stiffness * specimen.pad_stiffness)


@given(SEEDS)
def test_a_changed_damper_is_refused_or_opposes_motion(seed):
    text = changed('{velocity: [0, 0.01, 0.05, 0.2], force: [0, 20, 60.5, 90]}', seed)
    with contextlib.suppress(DamperError, ParameterError):
        assert damper_curve(text).table.min() >= 0.0
