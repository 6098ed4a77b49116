"""Electronics that compute the law themselves: their table, when they begin, and who is stronger."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from c_controller import CController, built, exported
from simulated_mounts import make_mount

from mount_driver.can_library import can
from mount_driver.can_messages import Setpoint, TablePoint, table_crc
from mount_driver.protocol import AliveCounter, MountCodec
from mount_models.quantity import ParameterError
from mount_sim.electronics.can_end import CanEnd
from mount_sim.electronics.own_law import OwnLaw
from mount_sim.loop import ElectronicsLoop
from mount_sim.quantisation import quantised_setpoint_current

CODEC = MountCodec()
CURRENT, FORCE, OFFSET = (0.4, 0.9, 1.4, 2.2, 3.0), (0.0, 30.0, 80.0, 170.0, 280.0), 0.5
POINTS = [(OFFSET, 0.0), *zip(CURRENT, FORCE, strict=True)]
DAMPING = {'policy': 'switched_viscous', 'switching': 'always'}
_channels = itertools.count()


@pytest.fixture(scope='module')
def library(tmp_path_factory):
    return built(exported(tmp_path_factory.mktemp('own_law'), DAMPING), 'gcc')


@pytest.fixture
def law(library):
    return OwnLaw(str(library), 1000.0)


def load(law, points=POINTS, crc=None):
    """Give all points; return which one the law waits for behind each."""
    crc = table_crc(points) if crc is None else crc
    frames = (TablePoint(number, len(points), crc, *point) for number, point in enumerate(points))
    return [law.take_point(frame).next_point for frame in frames]


def test_a_table_with_another_checksum_or_one_that_c_refuses_is_waited_for_anew(law):
    assert load(law) == [1, 2, 3, 4, 5, 6]
    assert load(law, crc=7)[-1] == 0
    assert load(law, [(OFFSET, 0.0), (0.9, 0.0), (0.4, 30.0)])[-1] == 0
    law.take_sample(0, 0, 0.0)
    assert list(law.take_answer(0)) == []
    assert load(law)[-1] == 6
    assert len(list(law.take_answer(0))) == 1


def test_the_law_begins_afresh_with_the_first_sample_that_the_host_answers(law, library):
    load(law)
    sway = 1e-3 * np.sin(2 * np.pi * 8e-3 * np.arange(400))
    for first in (3, 200):
        law.stop()
        frames = []
        for number in range(first - 2, first + 150):
            if number == first + 2:  # an answer that comes late
                frames += law.take_answer(first)
            frame = law.take_sample(number, number * 1_000_000, sway[number])
            frames += [frame] if number >= first + 2 else []
        core = CController(library, DAMPING)
        core.set_table(CURRENT, FORCE, OFFSET)
        stamps = np.arange(first, first + 150) * 1_000_000
        currents, _ = core.run(stamps, sway[first : first + 150])
        assert [frame.current for frame in frames] == currents.tolist()
        assert [frame.answered_counter for frame in frames] == list(range(first, first + 150))
        assert currents.max() > 0.9


@pytest.mark.parametrize('text', ['no_library.so', __file__])
def test_what_is_no_library_of_the_law_is_refused(text):
    with pytest.raises(ParameterError, match=r'controller_library .* cannot be used'):
        OwnLaw(text, 1000.0)


@pytest.fixture
def bench(law):
    """Electronics with the law on the bench, and a host that answers each sample."""
    channel = f'test_own_law_{next(_channels)}'
    bus, host = (
        can.Bus(interface='virtual', channel=channel, protocol=can.CanProtocol.CAN_FD) for _ in range(2)
    )
    end, mount, alive = CanEnd(bus, 1000.0, law), make_mount(timeline__duration=2.0), AliveCounter()
    layout = CODEC.own_setpoint
    load(law)
    loop = ElectronicsLoop(mount, end, lambda number: None)

    def answer(count, current, *, enable=True):
        """Answer samples with `current` (A); return own setpoints and those that the coil followed, A."""
        own, followed = [], []
        for _ in range(count):
            loop.send_sample()
            loop.go_on()
            frames = [
                each for each in iter(lambda: host.recv(0.0), None) if each.arbitration_id == layout.frame_id
            ]
            own += [layout.decode(frame.data)[1].current for frame in frames]
            data = CODEC.encode_setpoint(Setpoint(current, mount.sample - 1, enable), alive.next())
            host.send(can.Message(arbitration_id=CODEC.setpoint.frame_id, data=data, is_fd=True))
            followed.append(mount.current)
        return np.array(own), np.array(followed)

    yield SimpleNamespace(answer=answer, mount=mount, law=law)
    end.close()
    host.shutdown()


def test_the_coil_follows_the_lower_one_of_own_and_host_s_setpoint(bench):
    own, followed = bench.answer(300, 3.0)
    own = own[np.isfinite(own)]
    assert own.max() > 1.0
    assert followed[1:].tolist() == [quantised_setpoint_current(each) for each in own[:-1]]
    _, followed = bench.answer(200, 0.6)
    assert followed[2:].max() == 0.6
    assert followed[2:].min() < 0.6


def test_a_host_that_withdraws_enable_takes_the_coil_to_0_a_and_the_law_rests(bench):
    assert bench.answer(300, 3.0)[1].max() > 1.0
    own, followed = bench.answer(100, 3.0, enable=False)
    assert (followed[1:] == 0.0).all()
    assert np.isnan(own[2:]).all()
    assert np.isfinite(bench.answer(100, 3.0)[0][2:]).all()
