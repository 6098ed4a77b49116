"""`engine-mount report` on drives of the simulated car, on foreign and damaged recordings, in a browser."""

import html
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest
from command_line import command, refused
from references import REFERENCES_FOLDER

from engine_mount.reports import report
from engine_mount.reports.sections import overview as overview_section
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.cdr import string_message

PAPER = ('--set', 'mount_control.policy=switched_viscous')
BENCH = ('--scenario', 'bench', '--duration', '2.5', '--set', 'mount_sim.timeline.start=2.8', *PAPER)
SHORT = ('--scenario', 'bench', '--duration', '0.6', '--set', 'mount_sim.timeline.start=2.8')
MOST = 1_500_000  # bytes of a page
BROWSERS = ('chromium', 'chromium-browser', 'google-chrome')


class Page(HTMLParser):
    """What a page holds: its text, its sections, its figures, and whatever it would load."""

    def __init__(self, file: Path):
        super().__init__()
        self.sections: list[str] = []
        self.figures: list[dict] = []
        self.loaded: list[str] = []
        self.words: list[str] = []
        self._script = ''
        self.feed(file.read_text(encoding='utf-8'))
        self.text = ' '.join(' '.join(self.words).split())

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if tag == 'section':
            self.sections.append(values['id'])
        self._script = values.get('type', 'code') if tag in ('script', 'style') else ''
        loads = [values.get(name) or '' for name in ('src', 'srcset', 'data', 'href') if name in values]
        self.loaded += [each for each in loads if not each.startswith('#')]

    def handle_data(self, data):
        if self._script == 'application/json':
            self.figures.append(json.loads(data))
        elif not self._script:
            self.words.append(data)

    def handle_endtag(self, tag):
        if tag in ('script', 'style'):
            self._script = ''


@pytest.fixture(scope='module')
def bench(tmp_path_factory) -> Path:
    """Return the folder of a drive on the test rack."""
    folder = tmp_path_factory.mktemp('drives') / 'rack'
    assert f'report     {folder / "report.html"}' in command('drive', '--core', *BENCH, '--out', folder)
    return folder


@pytest.fixture(scope='module')
def page(bench) -> Page:
    """Return the page that the drive itself wrote."""
    return Page(bench / 'report.html')


def test_the_page_of_a_drive_shows_all_that_was_recorded(page, bench):
    assert page.sections == [
        'overview', 'traces', 'switching', 'hysteresis', 'harmonics', 'spectra', 'coil', 'tracking',
        'losses', 'parameters',
    ]  # fmt: skip
    assert len(page.figures) == 5
    labels = {figure['x_label'] for figure in page.figures}
    labels |= {panel['label'] for figure in page.figures for panel in figure['panels']}
    assert all(label.endswith(')') for label in labels - {'harmonic'})  # each axis has its unit
    assert 'damping switched on once' in page.text
    assert 'mount_sim.scenario bench' in page.text
    error = json.loads((bench / 'summary.json').read_text())['tracking_error_rms']
    assert f'friction force error {100 * error:.1f} % rms' in page.text


def test_a_section_that_fails_is_a_sentence_in_page_and_terminal_and_never_the_end_of_a_drive(
    tmp_path, monkeypatch
):
    def harmonics(subjects):
        raise ZeroDivisionError('a section with [brackets] fails')

    def overview(subjects):
        harmonics(subjects)

    made = tuple(harmonics if make.__name__ == 'harmonics' else make for make in report.SECTIONS)
    monkeypatch.setattr(report, 'SECTIONS', made)
    monkeypatch.setattr(overview_section, 'overview', overview)
    printed = command('drive', '--core', *SHORT, '--out', tmp_path / 'run')
    page = Page(tmp_path / 'run' / 'report.html')
    for name in ('overview', 'harmonics'):
        told = f'section {name} could not be made: a section with [brackets] fails'
        assert f'note {told}' in printed
        assert told.capitalize() in page.text
    assert page.sections[0] == 'overview'
    assert {'harmonics', 'traces', 'losses', 'parameters'} <= set(page.sections)


@pytest.mark.parametrize(
    ('broken', 'file'),
    [
        ('engine_mount.reports.sections.motion.draw_drive', 'drive.png'),
        ('engine_mount.reports.report.make_report', 'report.html'),
    ],
)
def test_a_drive_whose_picture_or_page_cannot_be_made_says_so_and_keeps_its_figures(
    broken, file, tmp_path, monkeypatch
):
    def fail(*_):
        raise ZeroDivisionError('nothing to draw')

    monkeypatch.setattr(broken, fail)
    printed = command('drive', '--core', *SHORT, '--out', tmp_path / 'run', codes=(1,))
    assert f'note {file} could not be made: nothing to draw' in printed
    assert f'recording  {tmp_path / "run" / "recording"}' in printed
    assert (tmp_path / 'run' / 'summary.json').exists()


def test_a_page_needs_nothing_else_and_is_small(page, bench):
    assert page.loaded == []
    assert "default-src 'none'" in (bench / 'report.html').read_text(encoding='utf-8')
    assert (bench / 'report.html').stat().st_size < MOST


def test_pictures_lie_beside_the_page(bench, tmp_path):
    command('report', bench, '--out', tmp_path / 'page.html')
    names = {file.name for file in (tmp_path / 'page').iterdir()}
    assert names == {
        f'{name}.png' for name in ('time_traces', 'hysteresis', 'harmonics', 'spectra', 'tracking')
    }


def test_two_recordings_share_the_figures_and_their_differences_are_told(tmp_path):
    compared = ('--compare', REFERENCES_FOLDER / 'rough', '--out', tmp_path / 'two.html')
    command('report', REFERENCES_FOLDER / 'gap', *compared)
    page = Page(tmp_path / 'two.html')
    panels = page.figures[0]['panels']
    names = {curve['name'] for panel in panels for curve in panel['curves']}
    assert {'displacement, gap', 'displacement, rough', 'current, gap', 'current, rough'} <= names
    assert 'differences' in page.sections
    assert [panel['label'] for panel in panels[1::2]] == ['displacement, B - A (mm)', 'current, B - A (A)']
    assert 'mount_sim.motorway.gap_depth is 0.03 in A, 0 in B' in page.text
    assert 'No mount force was recorded.' in page.text
    assert 'sim/truth' in page.text


def test_a_foreign_recording_gets_a_page_that_says_what_is_missing(tmp_path):
    writer = BagWriter(tmp_path / 'foreign')
    writer.add_topic('/chatter', 'std_msgs/msg/String')
    writer.add_topic('/session', 'std_msgs/msg/String')
    writer.write('/chatter', string_message('hello'), 1_000)
    writer.write('/session', string_message('note: </script><script>alert(1)</script>'), 2_000)
    writer.close()
    command('report', tmp_path / 'foreign')
    page = Page(tmp_path / 'foreign_report.html')
    assert 'there is no topic displacement' in page.text
    assert 'When damping was switched was not recorded.' in page.text
    assert page.figures == []
    assert 'note </script><script>alert(1)</script>' in page.text  # as text, not as a script
    assert (tmp_path / 'foreign_report.html').read_text(encoding='utf-8').count('<script') == 0


def test_a_damaged_recording_is_reported_as_far_as_it_goes(bench, tmp_path):
    shutil.copytree(bench / 'recording', tmp_path / 'damaged')
    (file,) = (tmp_path / 'damaged').glob('*.mcap')
    raw = file.read_bytes()
    damaged = slice(len(raw) // 3, len(raw) // 3 + 60_000)  # bytes: no index between two chunks is so long
    file.write_bytes(raw[: damaged.start] + bytes(60_000) + raw[damaged.stop : 3 * len(raw) // 4])
    command('report', tmp_path / 'damaged')
    text = Page(tmp_path / 'damaged_report.html').text
    assert re.search('(is|are) damaged and left out', text)  # one chunk or two, by where they lie
    assert 'Lost: ' in text


def test_what_is_no_recording_is_refused_in_a_sentence(tmp_path):
    (tmp_path / 'x.mcap').write_bytes(b'hello')
    assert 'is no MCAP file' in refused('report', tmp_path / 'x.mcap', codes=(2,))
    assert '7 recordings in one report are too many' in refused('report', *[REFERENCES_FOLDER / 'gap'] * 7)


@pytest.fixture(scope='module')
def browser() -> str:
    """Return a browser without a screen."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(f'no browser: none of {", ".join(BROWSERS)} is installed')
    return found


def shown(browser: str, file: Path, profile: Path) -> subprocess.CompletedProcess:
    """Return what a browser without network makes of a page, and what it logs."""
    quiet = (
        '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
        '--disable-background-networking', '--disable-component-update', '--disable-sync',
        '--host-resolver-rules=MAP * ~NOTFOUND',  # no network at all
    )  # fmt: skip
    return subprocess.run(
        [
            browser, *quiet, f'--user-data-dir={profile}', '--enable-logging=stderr',
            '--window-size=1080,3000', '--virtual-time-budget=30000', '--dump-dom',
            file.resolve().as_uri(),
        ],
        capture_output=True, text=True, timeout=240, check=True,
    )  # fmt: skip


def test_a_browser_draws_every_figure_and_has_nothing_to_complain_about(browser, bench, page, tmp_path):
    found = shown(browser, bench / 'report.html', tmp_path)
    root = re.search(r'<html[^>]*>', found.stdout)
    assert root is not None
    assert 'data-ready="yes"' in root[0]
    assert 'data-error' not in root[0]
    assert f'data-drawn="{len(page.figures)}"' in root[0]
    # the browser's own console
    assert not [line for line in found.stderr.splitlines() if 'CONSOLE' in line]
    assert found.stdout.count('<canvas') == sum(len(figure['panels']) for figure in page.figures)


USED = """
(function use() {
if (!root.dataset.ready) return setTimeout(use, 20);
const traces = charts.find((each) => each.place.dataset.chart === 'traces');
const key = (key) => traces.place.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
const canvas = traces.panels[0].canvas, told = {};
canvas.setPointerCapture = () => {};
function point(type, share) {
  const box = canvas.getBoundingClientRect(), clientX = box.left + LEFT + share * (box.width - LEFT - RIGHT);
  canvas.dispatchEvent(new PointerEvent(type, { pointerType: 'mouse', clientX, bubbles: true }));
}
const link = [...document.querySelectorAll('a[data-at]')].find((each) => each.hash === '#traces');
link.click();
told.at = Number(link.dataset.at);
told.linked = traces.shown;
told.spikes = charts.map((each) => each.spike);
charts.forEach(paintChart);
told.numbers = [...traces.place.querySelectorAll('output')].map((each) => each.textContent.trim());
key('+'); told.zoomed = traces.shown;
key('ArrowRight'); told.moved = traces.shown;
key('0'); told.whole = traces.shown;
point('pointerdown', 0.25);
point('pointermove', 0.75);
point('pointerup', 0.75);
told.dragged = traces.shown;
document.body.dataset.told = JSON.stringify(told);
})();
"""


def test_links_keys_and_mouse_move_a_chart_and_one_line_reads_all_of_them(browser, bench, tmp_path):
    text = (bench / 'report.html').read_text(encoding='utf-8')
    used = tmp_path / 'used.html'
    used.write_text(text.replace('</body>', f'<script>{USED}</script></body>'), encoding='utf-8')
    found = re.search(r'data-told="([^"]*)"', shown(browser, used, tmp_path / 'profile').stdout)
    assert found is not None
    told = json.loads(html.unescape(found[1]))
    first, last = told['whole']
    assert told['linked'] == pytest.approx([told['at'] - 0.5, told['at'] + 0.5], abs=1e-3)
    assert told['spikes'].count(pytest.approx(told['at'])) == 2  # displacement and current, tracking
    assert all(re.fullmatch(r'-?[0-9.]+( … -?[0-9.]+)? (mm|A)', number) for number in told['numbers'])
    middle, half = told['at'], 0.25
    assert told['zoomed'] == pytest.approx([middle - half, middle + half], abs=1e-3)
    assert told['moved'] == pytest.approx([middle - half + 0.1, middle + half + 0.1], abs=1e-3)
    assert told['dragged'] == pytest.approx(
        [first + 0.25 * (last - first), first + 0.75 * (last - first)], abs=0.02
    )
