"""Calibrations from MCAP recordings, as a rack makes them in the topics of a drive."""

import time

import numpy as np
import pytest
from command_line import command

from engine_mount.identification.fitting import IdentificationError
from engine_mount.identification.rack import FileValues, read_force, read_ripple
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.signal import SignalError
from mount_models.actuator import checked_force
from mount_models.coil.gap import evaluate
from mount_models.sampling import SAMPLE_RATE
from mount_models.specimen import default_specimen, load_specimen
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.cdr import string_message, temperature, wrench
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.topics import COIL_RIPPLE, COIL_TEMPERATURE, SESSION, SIM_CLAMP_FORCE
from mount_sim.electronics.electronics import status_every
from mount_sim.plant.reluctance import force as magnetic_force
from mount_sim.rack import drawn_rack, record_ripple

RACK = drawn_rack(5)
GAPS = np.linspace(280e-6, 540e-6, 8)
AREA = default_specimen().turns_area
NOTHING = FileValues()


def record(folder, gap, celsius=20.0, spoil=0, warming=0.0):
    """Record one held gap; every `spoil`-th ripple has no slopes, the coil grows warmer by `warming` K/s."""
    columns = record_ripple(RACK, gap, celsius, duration=1.5, peak_current=2.5)
    current = columns['current_a']
    slopes = np.stack([columns['current_rate_a_per_s'], columns['flux_rate_t_per_s']], axis=1)
    if spoil:
        slopes[::spoil] = np.nan
    noise = 1.0 + 0.01 * np.random.default_rng([5, round(gap * 1e9)]).standard_normal(current.size)
    pull = noise * np.array([magnetic_force(RACK.actuator, i, gap) for i in current.tolist()])
    writer, begin, stamps = BagWriter(folder), time.time_ns(), 1_000_000 * np.arange(current.size)
    for topic in (SESSION, COIL_RIPPLE, COIL_TEMPERATURE, SIM_CLAMP_FORCE):
        writer.add_topic(f'/{topic.name}', topic.type)
    writer.write(f'/{SESSION.name}', string_message('scenario: rack'), begin)
    currents = np.stack([current, np.full(current.size, np.nan)], axis=1)
    rows = ScalarsLayout(COIL_RIPPLE).pack_rows(stamps, currents, slopes)
    forces = OneNumberLayout(wrench).pack_rows(stamps, pull)
    topics = [f'/{COIL_RIPPLE.name}', f'/{SIM_CLAMP_FORCE.name}']
    writer.write_columns(topics, [rows, forces], begin + stamps)
    for stamp in stamps[:: status_every(SAMPLE_RATE)].tolist():
        raw = OneNumberLayout(temperature).pack(stamp, celsius + warming * 1e-9 * stamp)
        writer.write(f'/{COIL_TEMPERATURE.name}', raw, begin + stamp)
    writer.close()
    return folder


def test_force_and_gap_curves_come_out_of_recordings(tmp_path):
    recordings = [record(tmp_path / f'held_{gap * 1e6:.1f}um', gap, spoil=40) for gap in GAPS]
    recordings += [record(tmp_path / f'warm_{gap * 1e6:.1f}um', gap, 80.0, spoil=40) for gap in GAPS[::2]]
    written, area = tmp_path / 'left.yaml', RACK.actuator.turns * RACK.actuator.gap_area
    target = ('--name', 'left', '--out', written)
    command('calibrate', 'actuator', *recordings, *target)
    command('calibrate', 'inductance', *recordings, '--turns-area', area, '--base', written, *target)
    specimen, currents = load_specimen(written, 'left'), np.linspace(0.5, 2.4, 10)
    for gap in (300e-6, 400e-6, 500e-6):
        truth = np.array([magnetic_force(RACK.actuator, i, gap) for i in currents])
        fitted = checked_force(specimen.force_law, currents, np.full(10, gap))
        assert np.sqrt(np.mean((fitted / truth - 1.0) ** 2)) < 0.01
        measured = record_ripple(RACK, gap, duration=1.5, peak_current=2.5)
        at_rest = np.mean(measured['flux_rate_t_per_s'][:500] / measured['current_rate_a_per_s'][:500])
        told = evaluate(specimen.gap_curves.gap_of_inductance, specimen.turns_area * at_rest)
        assert float(told) == pytest.approx(gap, abs=2e-6)
    for part in ('force_law', 'gap_curves'):
        named = specimen.provenance['parts'][part]['recordings']
        assert [entry['file'] for entry in named] == [file.name for file in recordings]


def test_gap_and_temperature_of_a_recording_are_its_name_and_its_topic(tmp_path):
    bag = record(tmp_path / 'held_349um', 349e-6, celsius=61.2)
    (ripple,) = read_ripple([bag], Mapping(), NOTHING, AREA)
    columns = record_ripple(RACK, 349e-6, 61.2, duration=1.5, peak_current=2.5)
    assert (ripple.gap, ripple.celsius) == (pytest.approx(349e-6), pytest.approx(61.2))
    np.testing.assert_array_equal(ripple.current, columns['current_a'])
    np.testing.assert_allclose(
        ripple.inductance, AREA * columns['flux_rate_t_per_s'] / columns['current_rate_a_per_s'], rtol=1e-12
    )
    given = FileValues({bag: 350e-6}, {bag: 20.0})
    (ripple,) = read_ripple([bag], {}, given, AREA)
    assert (ripple.gap, ripple.celsius) == (350e-6, 20.0)
    (file,) = bag.glob('*.mcap')
    (of_file,) = read_ripple([file], Mapping(), FileValues({file: 350e-6}), AREA)
    np.testing.assert_array_equal(of_file.inductance, ripple.inductance)


def test_a_recording_without_what_is_needed_is_refused(tmp_path):
    bag = record(tmp_path / 'held', 349e-6)
    with pytest.raises(IdentificationError, match='its air gap is not known; add --gap held=UM'):
        read_ripple([bag], Mapping(), NOTHING, AREA)
    given = FileValues({bag: 349e-6}, {})
    with pytest.raises(SignalError, match=r"has no column 'sim/mount_force.wrench.force.z'"):
        read_force([bag], {'force': 'sim/mount_force.wrench.force.z'}, given)


@pytest.mark.parametrize(
    ('spoiled', 'sentence'),
    [
        ({'spoil': 5}, '20% of the inductances are not positive, at most 10%'),
        ({'warming': 10.0}, r'the coil temperature ran from 20\.0 to 34\.0 degC'),
    ],
)
def test_a_recording_without_slopes_or_of_a_coil_that_warmed_is_refused(tmp_path, spoiled, sentence):
    bag = record(tmp_path / 'held_349um', 349e-6, **spoiled)
    with pytest.raises(IdentificationError, match=sentence):
        read_ripple([bag], Mapping(), NOTHING, AREA)
