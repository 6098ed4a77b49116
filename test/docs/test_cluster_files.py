"""The files for a cluster can be read by what takes them; none was run on one."""

import subprocess

import yaml
from pages import REPOSITORY, blocks

PAGE = REPOSITORY / 'docs' / 'how-to' / 'fleet_on_a_cluster.md'


def test_each_file_is_of_its_language():
    manifests, script, code = (next(blocks(PAGE, language)).text for language in ('yaml', 'bash', 'py'))
    kinds = [document['kind'] for document in yaml.safe_load_all(manifests)]
    assert kinds == ['DaskCluster', 'NetworkPolicy', 'Job']
    subprocess.run(['bash', '-n'], input=script, text=True, check=True)
    compile(code, 'fleet_on_a_cluster.py', 'exec')
