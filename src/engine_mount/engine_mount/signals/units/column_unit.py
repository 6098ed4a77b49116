"""In which unit a column is: what hand, mapping file and header say, weighed against its values."""

from engine_mount.signals.formats.measured import Measured, MeasuredColumn
from engine_mount.signals.units.columns import place
from engine_mount.signals.units.mapping import ColumnChoice, Mapping
from engine_mount.signals.units.plausibility import Size, doubt, gravity_unit, guesses, scaled, size_of
from engine_mount.signals.units.quantities import Quantity
from engine_mount.signals.units.unit import Unit, UnitError, is_unit, unit_of

_SAME_FACTOR = 0.01  # chosen: a calibration differs from a unit's factor by less


def unit_of_column(
    measured: Measured, mapping: Mapping, wanted: Quantity, column: MeasuredColumn, choice: ColumnChoice
) -> tuple[Unit, float, list[str]]:
    """Return the unit of a column, the factor on its SI values, and sentences on what was taken for granted.

    What is said by hand or in a mapping file goes before the header; either must be one in which the values
    can be. Raises `UnitError`.
    """
    judge = _Judge(measured, mapping, wanted, column)
    header = column.unit if column.unit and is_unit(column.unit) else ''
    notes = []
    if column.unit and not header:
        notes.append(f'{column.name}: the unit {column.unit!r} in its header is not known here')
    said = choice.unit
    if said or header:
        unit = judge.right_dimension(unit_of(said or header), 'you say' if said else 'its header says')
    else:
        return *judge.without_unit(choice.scale, notes), notes
    if said and header and unit_of(header) != unit:
        notes.append(f'{column.name}: its header says {header}; taken as {said}, as you say')
    scale = 1.0 if choice.scale is None else choice.scale
    if not said:
        scale = judge.scale_beside_header(scale, unit)
    judge.believe(unit, by_hand=bool(said), notes=notes)
    return unit, scale, notes


def factor_beside_unit(scale: float, unit: Unit) -> float | None:
    """Return the factor to SI where a header names `unit` and a hand `scale` alone; None: they disagree.

    A scale of 1 or -1 turns an axis; one that is the factor of the unit says it twice.
    """
    if abs(scale) == 1.0:
        return scale * unit.factor
    return scale if abs(abs(scale) / unit.factor - 1.0) <= _SAME_FACTOR else None


class _Judge:
    """Weighs the unit of one column against its values; refusals name file, column, guess and remedy."""

    def __init__(self, measured: Measured, mapping: Mapping, wanted: Quantity, column: MeasuredColumn):
        self.where = f'{place(measured)}, column {column.name!r}'
        self.mapping, self.wanted, self.column = mapping, wanted, column
        self.size: Size = size_of(column.values)

    def option(self, unit: str) -> str:
        """Return how a command says that the column is in `unit`."""
        return self.mapping.options.format(quantity=self.wanted.name, column=self.column.name, unit=unit)

    def right_dimension(self, unit: Unit, who: str) -> Unit:
        """Return the unit if it is one of the quantity, else raise `UnitError`."""
        if unit.dimension != self.wanted.dimension:
            raise UnitError(
                f'{self.where} is in {unit.symbol}, as {who}: that is {_article(unit.dimension)}, but '
                f'{self.wanted.name} is {_article(self.wanted.dimension)}; name another column or quantity'
            )
        return unit

    def believe(self, unit: Unit, *, by_hand: bool, notes: list[str]) -> None:
        """Raise `UnitError` where values cannot be in `unit`, or look like another that no hand excludes."""
        why, looks = doubt(self.wanted, self.size, unit), guesses(self.wanted, self.size)
        if why:
            raise UnitError(f'{self.where}: {why}{self._looks_like(looks)}')
        gravity = gravity_unit(self.size) if self.wanted.dimension == 'acceleration' else ''
        if gravity and unit_of(gravity) != unit:
            sentence = f'a mean of {self.size.mean:.4g} {unit.symbol} would be gravity in {gravity}'
            if not by_hand:
                raise UnitError(
                    f'{self.where}: {sentence}, its header says {unit.symbol}: write '
                    f'{self.option(gravity)}, or {self.option(unit.symbol)} if the header is right'
                )
            notes.append(f'{self.column.name}: {sentence}; taken as {unit.symbol}, as you say')

    def scale_beside_header(self, scale: float, unit: Unit) -> float:
        """Return the factor that is left of `scale` where the header names a unit and no hand does."""
        factor = factor_beside_unit(scale, unit)
        if factor is not None:
            return factor / unit.factor
        raise UnitError(
            f'{self.where}: its header says {unit.symbol} ({unit.factor:g} {self.wanted.unit.symbol} each), '
            f'the scale says {scale:g}: write {self.option(unit.symbol)} with the scale of a calibration, or '
            'of an axis (-1)'
        )

    def without_unit(self, scale: float | None, notes: list[str]) -> tuple[Unit, float]:
        """Return SI and the scale where nobody names a unit; raises `UnitError` for values of another."""
        unit = self.wanted.unit
        if scale is not None:
            self._believe_scale(scale)
            notes.append(f'{self.column.name}: factor {scale:g} to {unit.symbol}, as you say')
            return unit, scale
        gravity = gravity_unit(self.size) if self.wanted.dimension == 'acceleration' else ''
        if gravity == unit.symbol:
            notes.append(
                f'{self.column.name}: no unit is said; its mean of {self.size.mean:.4g} is gravity in '
                f'{gravity}: taken so'
            )
            return unit, 1.0
        looks = guesses(self.wanted, self.size)
        if self.wanted.dimension == 'length' and looks[:1] == (unit.symbol,):
            notes.append(
                f'{self.column.name}: no unit is said; taken as {unit.symbol}, in which its range is '
                f'{self.size.range:.4g}'
            )
            return unit, 1.0
        raise UnitError(f'{self.where}: no unit is said; {self._seen(gravity)}{self._looks_like(looks)}')

    def _believe_scale(self, scale: float) -> None:
        """Raise `UnitError` where values times `scale` cannot be the quantity in SI."""
        size = self.size
        moved = scaled(size, scale)
        gravity = gravity_unit(moved) if self.wanted.dimension == 'acceleration' else ''
        if gravity not in ('', self.wanted.unit.symbol):
            raise UnitError(
                f'{self.where}: with the scale of {scale:g} its mean is {moved.mean:.4g}: that is gravity in '
                f'{gravity}, not in m/s^2: write {self.option(gravity)} with the scale of the axis'
            )
        why = doubt(self.wanted, moved, self.wanted.unit)
        if why:
            looks = self._looks_like(guesses(self.wanted, size))
            raise UnitError(f'{self.where}: with the scale of {scale:g} {why}{looks}')

    def _seen(self, gravity: str) -> str:
        if gravity:
            return f'a mean of {self.size.mean:.4g} is gravity in {gravity}'
        return f'values from {self.size.low:.4g} to {self.size.high:.4g}'

    def _looks_like(self, looks: tuple[str, ...]) -> str:
        if not looks:
            return f'; in no unit of {_article(self.wanted.dimension)} would it be one: is it another column?'
        write = f'write {self.option(looks[0])}'
        if len(looks) == 1:
            return f'; it looks like {looks[0]}: {write}'
        return f'; it could be {", ".join(looks[:-1])} or {looks[-1]}: {write}, or the one that it is'


def _article(dimension: str) -> str:
    return f'{"an" if dimension[0] in "aeiou" else "a"} {dimension}'
