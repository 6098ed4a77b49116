"""What an identification of friction prints."""

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from engine_mount.cli.terminal import note

if TYPE_CHECKING:
    from engine_mount.identification.friction.found import Identification


def print_friction(found: 'Identification', console: Console) -> None:
    """Print steps, ladder and what keeps a coefficient from being written, notes first."""
    from engine_mount.identification.friction.figures import figures
    from engine_mount.identification.friction.found import chosen_fit

    for sentence in found.notes:
        note(console, sentence)
    result = figures(found)
    if found.ramps:
        console.print(_step_1(result['step_1']))
    if found.coefficients is not None:
        fit = chosen_fit(found)
        console.print(
            f'steps 2, 3: {len(found.lines)} strokes; Eqs (13), (14) meet them within {fit.a_rms:.4f} (a) '
            f'and {fit.b_rms_mm:.2f} 1/mm (b) rms',
            soft_wrap=True,
        )
        for variant, values in result['variants'].items():
            if values['held_out_error'] is not None:
                console.print(
                    f'  form of b: {variant}: {_percent(values["held_out_error"])} held out',
                    soft_wrap=True,
                )
    for each in result.get('validation', []):
        console.print(
            f'held out {each["recording"]}: full model {_percent(each["full_error"])}, simplified '
            f'{_percent(each["simplified_error"])}; macroslip {_percent(each["full_macroslip_error"])}, '
            f'{_percent(each["simplified_macroslip_error"])}',
            soft_wrap=True,
        )
    if 'pairs' in result:
        console.print(_pairs(result['pairs']))
    if 'ladder' in result:
        console.print(_ladder(result['ladder']))
        console.print(f'best: {result["best"]}', soft_wrap=True)
    for case in result['cases']:
        note(console, case['sentence'], 'warning')


def _step_1(ramps: list[dict]) -> Table:
    table = Table('step 1', 'c_Re (N/m)', 'c_R (N/m)', 'd_R (N s/m)', 'p (N/m)', 'T (s)')
    for each in ramps:
        contact, spread, printed = each['contact'], each['deviation'], each['printed']
        table.add_row(
            each['recording'],
            *(
                f'{contact[name]:.4g} ± {spread[name]:.1g}'
                for name in ('contact_stiffness', 'tangential_stiffness', 'tangential_damping')
            ),
            f'{each["machine_stiffness"]:.4g}',
            f'{each["time_constant"]:.4f}',
        )
        with_p, without = (printed[f'tangential_stiffness_c_xi_{which}'] for which in ('with_p', 'without_p'))
        table.add_row(
            '  Eqs (10), (11) as printed',
            _printed(printed['contact_stiffness']),
            f'{_printed(with_p)}, {_printed(without)} (c_xi with, without p)',
            _printed(printed['tangential_damping']),
            style='dim',
        )
    return table


def _printed(entry: dict[str, float]) -> str:
    return f'{entry["value"]:.4g} ({100 * entry["error"]:+.1f} %)'


def _pairs(pairs: list[dict]) -> Table:
    names = list(dict.fromkeys(pair['train'] for pair in pairs))
    table = Table('held-out error', *(name for name in pairs[0]['ladder']))
    table.caption = ', '.join(f'{number}: {name}' for number, name in enumerate(names, 1))
    for pair in pairs:
        table.add_row(
            f'{names.index(pair["train"]) + 1} -> {names.index(pair["held_out"]) + 1}',
            *(_percent(entry['held_out_error']) for entry in pair['ladder'].values()),
        )
    return table


def _ladder(ladder: dict[str, dict]) -> Table:
    table = Table('law', 'held out', 'training', 'explains', 'parameters')
    table.caption = 'errors: rms over rms; explains: share of the mean square of the force'
    for name, entry in ladder.items():
        first = next(iter(entry['parameters'].values()))
        count = len(first) if isinstance(first, dict) else len(entry['parameters'])
        table.add_row(
            name,
            _percent(entry['held_out_error']),
            _percent(entry['train_error']),
            _percent(entry['explained']),
            str(count),
        )
    return table


def _percent(value: float | None) -> str:
    return '-' if value is None else f'{100 * value:.1f} %'
