"""Every parameter of a node stands in the README of its package."""

import re

from pages import REPOSITORY

from mount_bringup.settings import defaults_of_nodes


def test_every_parameter_stands_in_the_readme_of_its_package_or_in_one_of_a_set():
    for node, parameters in defaults_of_nodes().items():
        text = (REPOSITORY / 'src' / node / 'README.md').read_text(encoding='utf-8')
        section = text.split('\n## Parameters\n')[1].split('\n## ')[0]
        named = set(re.findall(r'`([\w.]+(?:\.\*)?)`', section))
        groups = tuple(name.removesuffix('*') for name in named if name.endswith('.*'))
        assert [name for name in parameters if name not in named and not name.startswith(groups)] == [], node
