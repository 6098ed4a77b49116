"""`engine-mount identify`: from recordings to parameters of the pads, and to what became of them."""

from typing import Annotated

from engine_mount.cli.commands.options import (
    Dbc,
    Decimal,
    Delimiter,
    Figure,
    JsonFile,
    MapFile,
    Position,
    Rate,
    RecordingPlaces,
    TimeColumn,
    mapping_of,
    option,
    stated,
)
from engine_mount.cli.fetching import local
from engine_mount.cli.help import Command, group
from engine_mount.cli.rack import EXIT_CODES, Base, Name, Out, progress, publish

app = group('identify', 'Identify the pads from recordings, of a rack or of a car.')

FRICTION_EXAMPLES = (
    EXIT_CODES
    + """

`engine-mount identify friction --train ramp.csv 40N.csv 120N.csv --held-out 80N.csv --base left.yaml
--name left --out left.yaml` - into the specimen file that init and control load

`engine-mount identify friction --train a.json --held-out b.json c.json` - trained on one, predicting others

`engine-mount identify friction --train rig.mat --column friction_force=cell:lbf --step ladder` - any format

`engine-mount identify friction --train rig.blf --dbc rig.dbc --step ladder` - or of a CAN log

`engine-mount identify friction --train a.mf4 --held-out b.mf4 --map-file rig_2.yaml` - the mapping of a team
"""
)


@app.command(cls=Command, epilog=FRICTION_EXAMPLES)
def friction(
    train: Annotated[
        list[str] | None, option('recordings to fit: files of any format, recordings, URIs', 'FILE...')
    ] = None,
    held_out: Annotated[
        list[str] | None, option('recordings that no fit uses, for judgement', 'FILE...')
    ] = None,
    step: Annotated[str, option('auto, or only: ramp (step 1), sawtooth, ladder')] = 'auto',
    column: Annotated[
        list[str] | None,
        option('column, or topic.field, of a quantity; may be repeated', 'NAME=COLUMN:UNIT'),
    ] = None,
    map_file: MapFile = None,
    time: TimeColumn = '',
    rate: Rate = None,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    clamp: Annotated[
        str, option("JSON: normal force from the band's pull while sliding, at rest, or none")
    ] = 'sliding',
    zero: Annotated[
        str,
        option('zero of the force: law (from the loop) or recorded; default: law for JSON of a damper'),
    ] = '',
    seed: Annotated[int, option('seed of the starts of the searches')] = 0,
    json_file: JsonFile = None,
    base: Base = None,
    name: Name = '',
    out: Out = None,
    figure: Figure = None,
) -> None:
    """Identify the friction contact, and compare friction laws.

    Ramp-and-hold recordings give its springs and damper, sawtooths the coefficient of friction; every law of
    the ladder is fitted to the same strokes. Judge by the held-out error: rms error over rms force.
    """
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.identification import identify
    from engine_mount.identification.friction.files import friction_mapping
    from engine_mount.signals.mapping import with_options

    mapping = with_options(mapping_of(map_file), (), time, rate)
    columns = friction_mapping(column or [], mapping, stated(dbc, decimal, delimiter))
    screen = TerminalScreen()
    training, unseen = ([local(place, screen) for place in places or []] for places in (train, held_out))
    with progress() as bar:
        result = identify.friction(
            training, unseen, step=step, clamp=clamp, zero=zero, columns=columns, seed=seed,
            base=base or '', progress=bar,
        )  # fmt: skip
    publish(result, json_file, figure, out, name)


PADS_EXAMPLES = (
    EXIT_CODES
    + """

`engine-mount identify pads bags/*/recording --figure pads.png` - wear and friction over the starts of a car

`engine-mount identify pads bags/first bags/today --json pads.json` - today against the first probe
"""
)


@app.command(cls=Command, epilog=PADS_EXAMPLES)
def pads(
    recordings: RecordingPlaces,
    position: Position = '',
    base: Base = None,
    json_file: JsonFile = None,
    figure: Figure = None,
) -> None:
    """Show wear and friction of the pads over the starts of a car.

    Wear is the contact gap of each activation against the first. Friction needs recordings with the policy
    pad_probe at standstill, the engine idling; it is that of the first probe times the figure.
    """
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.identification import identify

    screen = TerminalScreen()
    places = [local(place, screen) for place in recordings]
    publish(identify.pads(places, mount=position, base=base or ''), json_file, figure)
