"""Writes docs/reference/names.md: what is chosen by its name, as the registries hold it.

`python test/docs/names_page.py` renews the page; `test_generated_pages.py` holds it against the registries.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from generated import PAGES, first_paragraph, page_of, table, written_by

from engine_mount.experiments.registry import listed
from mount_control.policy.registry import DEFAULT, POLICIES, prefix_of
from mount_models.damper import DAMPER_LAWS
from mount_models.quantity import quantities
from mount_sim.excitation.scenario import SCENARIO_NAMES
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import MOUNTS

PAGE = PAGES / 'names.md'

HEAD = f"""# Names

What a command or parameter chooses by its name. {written_by(__file__)}
Names of faults: [faults](faults.md); of parameters: [parameters](parameters.md); of topics:
[interface](interface.md#topics); of commands and options: [commands](commands.md).
"""


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD]
    parts += ['## Scenarios', '`engine-mount drive --scenario`, `mount_sim.scenario`.', scenarios()]
    parts += ['## Mounts', '`engine-mount drive --mount`, `mount_sim.mount`.', named(MOUNTS)]
    parts += ['## Policies', f'`mount_control.policy`; `{DEFAULT}` is the default.', policies()]
    parts += ['## Damper laws', '`mount_control.damper` of the policy `switched_viscous`.', dampers()]
    parts += ['## Experiments', '`engine-mount experiment`.', experiments()]
    return page_of(parts)


def scenarios() -> str:
    """Return the table of scenarios; each has a set of parameters of its name."""
    defaults = SimParameters()
    rows = [
        (f'`{name}`', first_paragraph(type(getattr(defaults, name)).__doc__), f'`mount_sim.{name}.*`')
        for name in SCENARIO_NAMES
    ]
    return table(('name', 'meaning', 'parameters'), rows)


def policies() -> str:
    """Return the table of policies with the prefix of their parameters and what they trace."""
    rows = [
        (
            f'`{name}`',
            first_paragraph(policy.__doc__),
            f'`{prefix_of(name)}.*`' if prefix_of(name) else 'without a prefix',
            ', '.join(f'`{field}` ({unit})' for field, unit in policy.TRACE.items()),
        )
        for name, policy in POLICIES.items()
    ]
    return table(('name', 'meaning', 'parameters', 'traced beside what all trace'), rows)


def dampers() -> str:
    """Return the table of damper laws with their parameters."""
    rows = [
        (f'`{name}`', first_paragraph(law.__doc__), ', '.join(parameters_of(law)))
        for name, law in DAMPER_LAWS.items()
    ]
    return table(('name', 'meaning', 'parameters with defaults'), rows)


def parameters_of(law: Any) -> Iterable[str]:
    """Yield each parameter of a law with default and unit."""
    for name, note in quantities(law).items():
        yield f'`{name}` {law._field_defaults[name]:g} {note.unit}'


def experiments() -> str:
    """Return the table of experiments."""
    return table(('name', 'repeats', 'meaning'), [(f'`{name}`', *rest) for name, *rest in listed()])


def named(names: Mapping[str, str]) -> str:
    """Return the table of names with their meaning."""
    return table(('name', 'meaning'), [(f'`{name}`', meaning) for name, meaning in names.items()])


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
