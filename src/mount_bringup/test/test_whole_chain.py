"""From recordings of a rack to a drive: files all the way, and no truth of the plant in any of them."""

import glob
import re
from pathlib import Path

import numpy as np
import pytest

from mount_bringup.command import main
from mount_bringup.core_chain import chosen_damper, control_parameters
from mount_bringup.core_run import run_core
from mount_bringup.evaluation import Drive, tracking_error
from mount_models.actuator.law import checked_force
from mount_models.coil.gap import evaluate
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import flattened
from mount_models.specimen import DEFAULT_SPECIMEN, load_specimen
from mount_ros import topics
from mount_ros.scalars import ScalarsLayout
from mount_sim.rack import drawn_rack
from mount_sim.rack_friction import drawn_friction

MAKEFILE = Path(__file__).resolve().parents[3] / 'Makefile'
SEED = 3  # 1 % noise on every sensor; actuator, coil and pads are drawn from it


def command(*words):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    assert ended.value.code == 0


def in_folder(folder, pattern):
    return sorted(folder.glob(pattern))


def globbed(word):
    """Return what a shell makes of `word`."""
    return sorted(glob.glob(word)) if glob.has_magic(word) else [word]


def identified(folder, seed, noise=0.01):
    """Return the specimen file that the commands make of the recordings of a drawn rack."""
    command('calibrate', 'rack', '--out', folder, '--seed', seed, '--noise', noise, '--drawn')
    file = folder / 'drawn.yaml'
    command('calibrate', 'actuator', folder / 'force.csv', '--name', 'drawn', '--out', file)
    ripple, friction = in_folder(folder, 'ripple_*.csv'), in_folder(folder, 'friction_*.csv')
    command('calibrate', 'inductance', *ripple, '--base', file, '--out', file)
    command(
        'identify', 'friction', '--step', 'sawtooth', '--train', *friction, '--base', file, '--out', file,
    )  # fmt: skip
    return file


def tracking(seed, file):
    """Return the rms error of the friction force over the wanted peak: bench, 8 Hz, 1 mm, drawn plant."""
    rack, (contact, coefs) = drawn_rack(seed), drawn_friction(seed)
    actuator = rack.actuator._asdict()
    sim = {
        'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 3.0, 'seed': seed,
        'electronics.ripple_noise': 0.01,
        **flattened(coefs, 'friction'), **flattened(contact, 'contact'),
        **{f'actuator.{name}': value for name, value in actuator.items()},
        **{f'coil.{name}': value for name, value in rack.coil._asdict().items()},
    }  # fmt: skip
    chosen = {'parameters_file': str(file), 'specimen': 'drawn'}
    settings = {'mount_sim': sim, 'mount_init': chosen, 'mount_control': chosen}
    wanted = (topics.DISPLACEMENT, topics.CONTROL_TRACE, topics.SIM_TRUTH)
    layouts = {topic.name: ScalarsLayout(topic) for topic in wanted}
    rows = {topic.name: [] for topic in wanted}

    def write(topic, raw, stamp):
        if topic.name in rows:
            rows[topic.name].append(layouts[topic.name].unpack(raw)[:2])

    outcome = run_core(settings, write)
    zero = round(outcome.excitation_start * 1e9)
    stamps = {name: np.array([stamp for stamp, _ in each]) for name, each in rows.items()}
    columns = {
        name: dict(zip(layouts[name].names, np.array([numbers for _, numbers in each]).T, strict=True))
        for name, each in rows.items()
    }
    samples, truth = stamps['displacement'], columns[topics.SIM_TRUTH.name]
    places = np.searchsorted(samples, stamps['control_trace'])
    active, current = np.zeros(samples.size, bool), np.zeros(samples.size)
    active[places] = columns['control_trace']['damping_active'] > 0.5
    current[places] = columns['control_trace']['current']
    drive = Drive(
        time=(samples - zero) / 1e9,
        displacement=columns['displacement']['mount'],
        current=current,
        damping_active=active,
        true_time=(stamps[topics.SIM_TRUTH.name] - zero) / 1e9,
        true_velocity=truth['velocity'],
        friction_force=truth['friction_force'],
        excitation_start=zero,
    )
    assert active.mean() > 0.3
    return tracking_error(drive, control_parameters(settings), chosen_damper(settings))


def test_a_drawn_actuator_with_drawn_pads_is_controlled_by_its_identified_files_alone(tmp_path):
    assert tracking(SEED, identified(tmp_path, SEED)) <= 0.04


def test_the_shipped_specimen_is_what_make_identify_writes(tmp_path):
    written = tmp_path / 'written.yaml'
    recipe = MAKEFILE.read_text().split('\nidentify:', 1)[1].split('\n\n', 1)[0].splitlines()[1:]
    assert len(recipe) == 4
    for line in recipe:
        words = re.fullmatch(r'\t@\$\(BIN\)/engine-mount (.*)', line)[1]
        words = words.replace('$(RACK)', str(tmp_path)).replace('$(SPECIMEN)', str(written)).split()
        command(*(each for word in words for each in globbed(word)))
    ours, shipped = load_specimen(written), load_specimen(DEFAULT_SPECIMEN, 'default')
    gaps, currents = np.linspace(270e-6, 550e-6, 29)[:, np.newaxis], np.linspace(0.05, 3.0, 60)
    assert checked_force(ours.force_law, currents, gaps) == pytest.approx(
        checked_force(shipped.force_law, currents, gaps), rel=1e-7
    )
    for curve, kept in zip(ours.gap_curves, shipped.gap_curves, strict=True):
        assert evaluate(curve, np.linspace(curve.low, curve.high, 9)) == pytest.approx(
            evaluate(kept, np.linspace(kept.low, kept.high, 9)), rel=1e-7
        )
    assert set(ours.friction) == {*FrictionCoefficients._fields, *FrictionContact._fields}
    assert ours.friction == pytest.approx(shipped.friction, rel=1e-4)
    assert ours.temperature is not None
    for name in ('turns_area', 'spring_stiffness', 'pad_stiffness', 'rest_current', 'current_limit'):
        assert getattr(ours, name) == getattr(shipped, name)
    assert set(shipped.provenance['parts']) == {'force_law', 'gap_curves', 'friction'}
