"""The files for a cluster can be read by what takes them; none was run on one."""

import subprocess

import yaml
from pages import REPOSITORY, blocks

PAGE = REPOSITORY / 'docs' / 'how-to' / 'fleet_on_a_cluster.md'


def texts(language):
    found = [block.text for block in blocks(PAGE, language)]
    assert found
    return found


def test_the_manifests_are_yaml_and_say_what_they_are():
    (text,) = texts('yaml')
    kinds = [document['kind'] for document in yaml.safe_load_all(text)]
    assert kinds == ['DaskCluster', 'NetworkPolicy', 'Job']


def test_the_script_of_the_queue_is_a_script():
    (text,) = texts('bash')
    subprocess.run(['bash', '-n'], input=text, text=True, check=True)


def test_the_python_is_python():
    (text,) = texts('py')
    compile(text, 'fleet_on_a_cluster.py', 'exec')
