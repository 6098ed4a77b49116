"""The matrix as the page docs/reference/faults.md."""

import re
from collections.abc import Mapping
from pathlib import Path

from engine_mount.faults.case import SAFE, FaultCase, Reaction
from engine_mount.faults.judge import AFTER_DETECTION, AFTER_OCCURRENCE, Outcome

Rows = Mapping[FaultCase, Outcome]

_RUN_FOLDER = re.compile(r'/\S*/(?=faults_\d+_\d+/)')  # of the machine that wrote the page
_HEADS = ('fault', 'what', 'detected by', 'ms', '0 A, ms', 'coil, A', 'sentence', 'recovery')
_INTRODUCTION = """# Faults

What the graph does about each fault, measured. `engine-mount dev faults --page FILE` writes this page, `make
faults` does it for all of them ([the command](../../src/engine_mount/engine_mount/cli/README.md#faults));
times are those of the machine that did.

Each fault is brought into a graph that damps (`engine-mount drive --scenario bench`: real processes, CAN
over UDP, real time) and observed from outside: by a listener on the bus, one on `/diagnostics` and one
on `sim/truth`, all on the steady clock. Times run from the beginning of the fault. *Detected*: the first
sentence or the first 0 A, what came first. *0 A*: the first setpoint of 0 A (or with `Enable` 0) on the
bus; where frames do not reach the electronics, or others send frames too, what the electronics follow.
*Coil*: its true current at the end of the fault.

Nothing tells of a displacement whose sign is wrong from the start (`displacement_inverted`), or turns within
0.5 mm of zero: friction opposes the motion whatever sign it is told, so that the damper goes on taking energy
and only the two directions of its law are exchanged (motorway drive in core: peak displacement 1.34 instead
of 1.44 mm, rms 0.107 instead of 0.113 mm, 0.970 instead of 0.993 J; the friction force misses the wanted one
by 16 instead of 0.4 %). What is told is the jump where it turns farther away (`displacement_flipped`).

The speed of the engine (`engine_speed_*`, `second_engine_speed`) only helps the law to find the engine's
line. What is doubted is not used and told, and damping goes on: friction takes energy out of the mount at any
speed. A wrong one that an engine can have (`engine_speed_wrong`) is told while it jumps there.

Required of every fault: at most 3 A on the bus; no traceback; no sample missing in the recording, but
for what the fault itself takes from it; no process, file of shared memory or held lock left behind. A
sentence has a value, its limit and a remedy. And by its group:

| group | required |
|---|---|
"""


def write_page(rows: Rows, file: Path) -> None:
    """Write the page about these outcomes; raises `OSError`."""
    parts = [_INTRODUCTION + ''.join(f'| {_title(each)} | {_required(each)} |\n' for each in Reaction)]
    for reaction in Reaction:
        chosen = {case: outcome for case, outcome in rows.items() if case.reaction is reaction}
        if chosen:
            parts.append(_section(reaction, chosen))
    file.write_text('\n'.join(parts), encoding='utf-8')


def _section(reaction: Reaction, rows: Rows) -> str:
    heads = f'| {" | ".join(_HEADS)} |\n' + '|---' * len(_HEADS) + '|\n'
    lines = []
    for case, outcome in rows.items():
        name, *cells = _cells(case, outcome)
        lines.append(
            '| ' + ' | '.join(_escaped(cell) for cell in (f'`{name}`', case.meaning, *cells)) + ' |\n'
        )
    return f'## {_title(reaction)}\n\n{heads}{"".join(lines)}'


def _title(reaction: Reaction) -> str:
    return reaction.name.replace('_', ' ').capitalize()


def _required(reaction: Reaction) -> str:
    detected, silent = 1e3 * AFTER_DETECTION, 1e3 * AFTER_OCCURRENCE
    limits = f'0 A within {detected:g} ms of detection, {silent:g} ms of the beginning of silence'
    return f'{reaction.value}; {limits}' if reaction in SAFE else reaction.value


def _cells(case: FaultCase, outcome: Outcome) -> list[str]:
    wrong = outcome.wrong
    return [
        case.name,
        outcome.detected_by or '-',
        _milliseconds(outcome.detected_s),
        _milliseconds(outcome.zero_s),
        '-' if outcome.coil_current_a is None else f'{outcome.coil_current_a:.2f}',
        _RUN_FOLDER.sub('bags/.../', outcome.sentence) or '-',
        f'{outcome.recovery}; NOT AS REQUIRED: {wrong}' if wrong else outcome.recovery,
    ]


def _milliseconds(seconds: float | None) -> str:
    return '-' if seconds is None else f'{1e3 * seconds:.0f}'


def _escaped(text: str) -> str:
    return text.replace('|', '\\|').replace('\n', ' ')
