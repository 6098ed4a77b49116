"""From a displacement sample to a coil current: a policy says which force, the force maker makes it.

What a step does is in `compiled_steps`, compiled once for each policy.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_control import force_maker, force_to_current
from mount_control.compiled_steps import compiled_with
from mount_control.settings import ControlSettings
from mount_models.arithmetic.record import record_bytes


class Tables(NamedTuple):
    """The tables that a control step looks up: that of the policy, and current (A) over normal force."""

    policy: NDArray[np.float64]
    current: NDArray[np.float64]


class Memory(NamedTuple):
    """The first arguments of the compiled `step`: bytes of law and state, tables, window of the policy."""

    law: NDArray[np.uint8]
    tables: Tables
    state: NDArray[np.uint8]
    window: NDArray[np.float64]


class ControlLaw:
    """All that a control step needs and does not change: made beforehand, taken by one controller."""

    def __init__(self, settings: ControlSettings, table: force_to_current.CurrentTable):
        self.compiled = compiled_with(settings.policy)
        sample_time = 1.0 / settings.parameters.sample_rate
        maker = force_maker.design(settings.friction, settings.contact, table.limits, sample_time)
        self.record = record_bytes(self.compiled.law(settings.design.law, maker))
        self.tables = Tables(settings.design.table, table.currents)
        self.window = np.zeros(settings.design.window)


class Controller:
    """The control law with its memory; the same compiled step serves node, lock-step and core runs."""

    def __init__(self, law: ControlLaw):
        self.compiled = law.compiled
        self._law, self._tables, self._window = law.record, law.tables, law.window
        self._state = np.zeros(1, self.compiled.state).view(np.uint8)
        self._state_record = self._state.view(self.compiled.state)[0]
        self._trace = np.zeros(1, self.compiled.trace).view(np.uint8)
        self._trace_record = self._trace.view(self.compiled.trace)[0]
        self.restart(0.0)

    @property
    def memory(self) -> Memory:
        """What the compiled `step` takes before trace and sample, for a compiled loop that calls it."""
        return Memory(self._law, self._tables, self._state, self._window)

    @property
    def trace(self) -> np.void:
        """The intermediates of the last step."""
        return self._trace_record

    @property
    def trace_bytes(self) -> bytes:
        """The intermediates of the last step as little-endian float64 numbers."""
        return self._trace.tobytes()

    @property
    def faults(self) -> int:
        """How often the memory was found to hold something that is no finite number, and was cleared."""
        return int(self._state_record['faults'])

    def restart(self, displacement: float) -> None:
        """Forget the past: a mount at rest at `displacement` (m), damping off."""
        self.compiled.start(self._law, self._state, self._window, displacement)

    def change(self, law: ControlLaw) -> None:
        """Go on with another law of the same policy, from the next sample on and without a jump.

        The policy carries its memory over, and where damping is on the current goes over to what the new law
        asks for within `force_maker.FADE_TIME`.
        """
        self.compiled.transfer(self._law, law.record, self._state, self._window, law.window)
        self._law, self._tables, self._window = law.record, law.tables, law.window

    def step(self, displacement: float, bridged_samples: int = 0) -> float:
        """Take one displacement sample in m and return the current setpoint in A.

        `bridged_samples` samples missing before it are replaced by a straight line. NaN and what lies
        beyond `FARTHEST_DISPLACEMENT` are answered with 0 A and leave no trace in the memory. Where the
        memory itself holds what is no finite number, the answer is 0 A, it is cleared as by `restart`, and
        that is counted in `faults`.
        """
        return self.compiled.step(
            self._law, self._tables, self._state, self._window, self._trace, displacement, bridged_samples
        )

    def run(
        self, displacement: NDArray[np.float64], traces: NDArray[np.void] | None = None
    ) -> NDArray[np.void]:
        """Take n displacement samples in m and return n traces; bit-identical to n calls of `step`.

        They are written into `traces`, n records `compiled.trace` in a row, where it is given.
        """
        if traces is None:
            traces = np.zeros(len(displacement), self.compiled.trace)
        samples = np.ascontiguousarray(displacement, dtype=float)
        self.compiled.run(self._law, self._tables, self._state, self._window, traces.view(np.uint8), samples)
        return traces


def load_compiled_law(settings: ControlSettings) -> None:
    """Run the compiled law once, so that the first sample need not wait for the compiler."""
    table = force_to_current.resample(np.array([0.4, 3.0]), np.array([0.0, 300.0]), 0.5, 3.0)
    controller = Controller(ControlLaw(settings, table))
    controller.step(0.0)
    controller.run(np.zeros(1))
    controller.change(ControlLaw(settings, table))
