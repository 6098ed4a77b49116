"""What the tests of all packages share: the fixtures of `ros_testing`, and examples that repeat.

In continuous integration a skip that `EXPECTED_SKIPS` does not name fails the run.

A job in the background of a shell ignores Ctrl-C, one under nohup the end of its terminal, and so would all
that the tests start and interrupt.

Hypothesis draws the same examples in every run, so that a test passes or fails by the code alone;
`pytest --hypothesis-profile=exploring` draws new ones, as many of each test as EXAMPLES says (100). No
example has a deadline: the first of a test may wait for the compiler.
"""

import os
import signal

import pytest
from hypothesis import settings

from mount_ros.environment import prepare_environment

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

prepare_environment()  # of the log too, whose form the first message of a process settles

pytest_plugins = ['ros_testing']

settings.register_profile('repeatable', derandomize=True, deadline=None)
settings.register_profile(
    'exploring', derandomize=False, deadline=None, max_examples=int(os.environ.get('EXAMPLES', '100'))
)
settings.load_profile('repeatable')

EXPECTED_SKIPS = {
    'ros2launch is not installed': 'there are no wheels: src/mount_bringup/README.md says when it was run',
}
"""{beginning of the reason: why continuous integration cannot do it}."""


def pytest_sessionfinish(session: pytest.Session) -> None:
    reporter = session.config.pluginmanager.get_plugin('terminalreporter')
    if not os.environ.get('CI') or reporter is None:
        return
    reasons = {report.longrepr[2].removeprefix('Skipped: ') for report in reporter.stats.get('skipped', ())}
    unexpected = sorted(reason for reason in reasons if not reason.startswith(tuple(EXPECTED_SKIPS)))
    if unexpected:
        reporter.write_line(f'\nskipped, not in EXPECTED_SKIPS of conftest.py: {unexpected}', red=True)
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
