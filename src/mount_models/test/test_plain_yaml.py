"""What is read is what PyYAML reads; what changes a meaning or has no bound is refused with its line."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from mount_models.plain_yaml import LONGEST_TEXT, YamlError, plain_yaml, yaml_in_file
from mount_models.specimen import DEFAULT_SPECIMEN

SCALARS = st.none() | st.booleans() | st.integers(-(1 << 63), (1 << 63) - 1) | st.floats(allow_nan=False)
TEXTS = st.text(st.characters(codec='utf-8', exclude_categories=['Cc', 'Cs', 'Zl', 'Zp']), max_size=20)
PLAIN = st.recursive(
    SCALARS | TEXTS,
    lambda parts: st.lists(parts, max_size=4) | st.dictionaries(TEXTS, parts, max_size=4),
    max_leaves=20,
)
SHARED = 'a: &a [1, {b: 2}]\nc: *a\n'
LAUGHS = 'a0: &a0 [x, x, x, x, x, x, x, x, x]\n' + ''.join(
    f'a{level}: &a{level} [{", ".join([f"*a{level - 1}"] * 9)}]\n' for level in range(1, 30)
)
REFUSED = {
    'a key twice': ('name: a\ngap: 1\nname: b\n', "line 3: the key 'name' stands there twice; keep one"),
    'a date as key': (
        'a: 1\n2026-05-04: 2\n',
        'line 2: the key datetime.date.* is no text; put it in quotes',
    ),
    'a number as key': ('{3: 1}', 'line 1: the key 3 is no text'),
    'a truth value as key': ('on: 1', 'the key True is no text'),
    'nothing as key': ('null: 1', 'the key None is no text'),
    'a list as key': ('? [a]\n: 1', r"the key \['a'\] is no text"),
    'a key twice inside of a list': ('- {a: 1, b: 2}\n- {a: 1, a: 1}\n', 'line 2: the key'),
    'references to references': (LAUGHS, 'more than 500000 values, written out'),
    'a reference to itself': ('&a [*a]', r'\*a refers to nothing before it'),
    'a mapping that is merged': (
        'a: &a {x: 1}\nb: {<<: *a, x: 2}\n',
        "line 2: '<<' .*merge.* not known here",
    ),
    'nested lists': ('[' * 1000, 'nested deeper than 40 levels'),
    'nested mappings': ('{a: ' * 1000, 'nested deeper than 40 levels'),
    'nested blocks': ('- ' * 1000, 'nested deeper than 40 levels'),
    'many digits': ('gap: ' + '9' * 10_000, 'line 1: a number of 10000 characters; at most 400'),
    'a number to the base of 60': ('1' + ':59' * 10_000, 'a number of 30001 characters'),
    'a number beyond 64 bits': ('a: 9223372036854775808', "'9223372036854775808' does not fit into 64 bits"),
    'a date that is none': ('a: 2026-02-30', "'2026-02-30' is no value .* put it in quotes"),
    'a tag of Python': ('!!python/object/apply:os.getcwd []', 'not known here'),
    'a set': ('!!set {a, b}', 'not known here'),
    'a wrong tag': ('!!int x', "'x' is no value"),
    'a tag of nothing': ("!!int ''", "'' is no value"),
    'several documents': ('a: 1\n---\nb: 2\n', 'line 2: a second document begins; leave the first alone'),
    'an open bracket': ('a: [1, 2\nb: 3\n', 'is not valid YAML in line 2: did not find expected'),
    'a control character': ('a: \0', 'is not valid YAML: .*control characters'),
    'half a character': ('a: \ud800', 'is not valid YAML: .*surrogates'),
    'a long text': ('a' * (LONGEST_TEXT + 1), 'is longer than 1048576 characters'),
}


@pytest.mark.parametrize('text', [DEFAULT_SPECIMEN.read_text(encoding='utf-8'), SHARED, '', '# only this'])
def test_what_is_read_is_what_pyyaml_reads(text):
    assert plain_yaml(text) == yaml.safe_load(text)


@given(PLAIN)
def test_what_pyyaml_writes_is_read_as_it_was(content):
    assert plain_yaml(yaml.safe_dump(content, allow_unicode=True)) == content


@pytest.mark.parametrize(('text', 'sentence'), REFUSED.values(), ids=REFUSED)
def test_what_changes_a_meaning_or_has_no_bound_is_refused(text, sentence):
    with pytest.raises(YamlError, match=sentence):
        plain_yaml(text)


def test_as_words_every_value_is_the_text_that_stands_there():
    text = 'a: 12:30\nb: [2026-02-30, off, ~]\n'
    assert plain_yaml(text, words=True) == {'a': '12:30', 'b': ['2026-02-30', 'off', '~']}


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / 'a.yaml'
    with pytest.raises(YamlError, match=r'cannot be read .No such file or directory.; give its full path'):
        yaml_in_file(path)
    path.write_bytes(b'a: \xff')
    with pytest.raises(YamlError, match=r'is no text .byte 3 is not UTF-8'):
        yaml_in_file(path)
    with pytest.raises(YamlError, match='is longer than'):
        yaml_in_file(Path('/dev/zero'))
