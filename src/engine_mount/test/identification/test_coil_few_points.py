"""Inductance tables as they come: few points per gap, rising first, several temperatures in one file."""

from dataclasses import replace

import numpy as np
import pytest

from engine_mount.identification.coil.curves import calibrate_gap_curves
from engine_mount.identification.coil.inductance import calibrate_inductance
from engine_mount.identification.coil.points import InductanceTable, RippleRecording, measured_point
from engine_mount.identification.coil.unique_region import unique_region
from engine_mount.identification.fitting import IdentificationError
from engine_mount.identification.rack import FileValues, read_ripple
from engine_mount.recordings.screen import Screen
from engine_mount.signals.mapping import Mapping
from mount_models.coil.gap import evaluate
from mount_models.quantity import LawRefusedError
from mount_models.specimen import default_specimen

GAPS = np.linspace(280e-6, 540e-6, 9)
CURRENTS = np.array([0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.75, 2.0, 2.5])
NOTHING = FileValues(celsius_of_others=20.0)


def inductance(current, gap, celsius=20.0, initial=0.0):
    """A coil by a formula of its own: reluctance of gap and core, a knee that moves with the gap.

    `initial` is the share by which it starts lower, as where iron is hardly magnetised.
    """
    core = 60e-6 * (1.0 + 0.001 * (celsius - 20.0))
    knee = 0.6 + 1.6e3 * gap
    plain = 16e-6 / (gap + core) / (1.0 + (current / knee) ** 4)
    return plain * (1.0 - initial * np.exp(-current / 0.15))


def table(gap, currents=CURRENTS, **how):
    return RippleRecording(
        f'{gap * 1e6:.0f} um', float(gap), 20.0, currents, inductance(currents, gap, **how)
    )


def true_crossing(gap, level):
    current = np.linspace(0.1, 2.5, 240001)
    return float(np.interp(-level, -inductance(current, gap), current))


def test_tables_of_twelve_points_give_gap_curves_and_say_how_well():
    points = [measured_point(table(gap), 0.25, 15e-3) for gap in GAPS]
    curves = calibrate_gap_curves(points).curves
    for gap in np.linspace(300e-6, 520e-6, 12):
        at_rest = float(evaluate(curves.gap_of_inductance, inductance(0.25, gap)))
        at_contact = float(evaluate(curves.gap_of_crossing_current, true_crossing(gap, 15e-3)))
        assert abs(at_rest - gap) < 1e-6
        assert abs(at_contact - gap) < 4e-6
    for point in points:
        truth = true_crossing(point.gap, 15e-3)
        assert abs(point.crossing_current - truth) < 3.0 * point.crossing_std
        assert 0.0 < point.crossing_std < 0.03
        assert point.table == (0.1, 2.5)


def test_a_rest_current_beyond_the_table_is_refused_with_its_range():
    with pytest.raises(LawRefusedError, match=r'280 um: was measured from 0\.50 to 2\.50 A only, 0\.20 A'):
        measured_point(table(GAPS[0], CURRENTS[3:]), 0.2, 15e-3)


def test_a_coil_whose_inductance_rises_first_is_taken_where_it_falls():
    gap = GAPS[4]
    rising = table(gap, initial=0.95)
    assert rising.inductance[0] < 20e-3 < rising.inductance.max()
    point = measured_point(rising, 0.2, 20e-3)
    assert point.crossing_current == pytest.approx(true_crossing(gap, 20e-3), abs=0.03)
    assert point.crossing_slope < 0.0


def test_a_coil_that_never_saturates_is_refused_for_that():
    currents = CURRENTS[:5]
    low = replace(table(GAPS[4], currents), inductance=np.linspace(8e-3, 14e-3, 5))
    with pytest.raises(LawRefusedError, match=r'rises with the current, from 8\.0 mH at 0\.10 A to 14\.0 mH'):
        measured_point(low, 0.2, 10e-3)


def test_a_level_that_is_not_reached_is_refused_with_the_range_of_the_table():
    refusal = r'280 um: .* fall through 50\.0 mH; instead it falls from .* choose a --crossing-inductance'
    with pytest.raises(LawRefusedError, match=refusal):
        measured_point(table(GAPS[0]), 0.25, 50e-3)


def test_four_currents_and_a_table_that_crosses_the_level_several_times_are_refused():
    with pytest.raises(LawRefusedError, match='300 um: 4 different currents, at least 5'):
        measured_point(table(300e-6, CURRENTS[:4]), 0.2, 15e-3)
    wild = table(300e-6)
    wild.inductance[-2] = 20e-3
    with pytest.raises(LawRefusedError, match=r'300 um: coil .* crosses it several times'):
        InductanceTable(wild).falls_through(15e-3)


def test_tables_tell_where_they_are_unique():
    region = unique_region([table(gap) for gap in GAPS])
    assert region.falling[0][0] <= 0.25 <= region.falling[0][1]
    assert any(low <= 15e-3 <= high for low, high in region.levels)


def written(file, celsius=(20.0,), drift=0.0):
    rows = ['gap_um,current_a,inductance_mh,coil_temperature_c']
    for degrees in celsius:
        for gap in GAPS:
            for number, current in enumerate(CURRENTS):
                warm = degrees + drift * number
                rows.append(
                    f'{gap * 1e6:.1f},{current},{1e3 * inductance(current, gap, degrees):.6f},{warm:.1f}'
                )
    file.write_text('\n'.join(rows) + '\n')
    return file


def test_temperatures_mixed_in_one_file_become_recordings_of_their_own(tmp_path, capsys):
    file = written(tmp_path / 'all.csv', (20.0, 80.0))
    recordings = read_ripple([file], Mapping(), NOTHING, 0.1)
    assert len(recordings) == 2 * GAPS.size
    assert {round(each.celsius) for each in recordings} == {20, 80}
    for each in recordings:
        np.testing.assert_allclose(each.inductance, inductance(CURRENTS, each.gap, each.celsius), rtol=1e-4)
    assert recordings[1].name.endswith('um, 80 degC')
    base = replace(default_specimen(), rest_current=0.25, crossing_inductance=15e-3, turns_area=0.1)
    result = calibrate_inductance(recordings, base, [file])
    assert result.compensated_by.startswith('measured at 20 and 80 degC')
    result.report(Screen())
    assert 'are tables of few points, measured within 0.10 .. 2.50 A' in capsys.readouterr().out
    specimen = result.specimen('own')
    assert specimen.provenance['parts']['gap_curves']['valid']['interpolated_within_current'] == [0.1, 2.5]


def test_a_temperature_that_runs_is_refused_still(tmp_path):
    file = written(tmp_path / 'runs.csv', drift=2.0)
    with pytest.raises(IdentificationError, match=r'coil temperature ran from 20\.0 to 42\.0 degC'):
        read_ripple([file], Mapping(), NOTHING, 0.1)
