"""Everything that can be set on the simulated mount."""

from typing import Annotated, Any, NamedTuple

from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_RATE, SampleRate
from mount_sim.electronics.electronics import ElectronicsParameters
from mount_sim.excitation.scenario import (
    SCENARIO_NAMES,
    BenchScenario,
    IdleForce,
    MotorwayScenario,
    RecordedScenario,
    RoadScenario,
    SweepScenario,
    Timeline,
    TipIn,
)
from mount_sim.plant.closing import ClosingMechanics
from mount_sim.plant.engine_body import RigidEngine
from mount_sim.plant.hydromount import Hydromount
from mount_sim.plant.mounts import MOUNTS, PLACES, Places, seated_mount
from mount_sim.plant.plant import Plant
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.ripple import RippleCoil, TemperatureCoefficients
from mount_sim.plant.vehicle import Vehicle


class SimParameters(NamedTuple):
    """Scenario, truth and faults of one simulated run."""

    scenario: Annotated[str, Quantity('word', 'what shakes engine and chassis', words=SCENARIO_NAMES)] = (
        'motorway'
    )
    mount: Annotated[str, Quantity('word', 'which mount is in the seat', words=tuple(MOUNTS))] = 'friction'
    mounts: Annotated[
        str,
        Quantity(
            'words',
            f'mounts with electronics under one engine, of {", ".join(PLACES)}, as in left,right; empty: one',
        ),
    ] = ''
    sample_rate: SampleRate = SAMPLE_RATE
    seed: Annotated[int, Quantity('1', 'seed of noise and road', 0, 2**31 - 1)] = 1
    timeline: Timeline = Timeline()
    bench: BenchScenario = BenchScenario()
    motorway: MotorwayScenario = MotorwayScenario()
    sweep: SweepScenario = SweepScenario()
    recorded: RecordedScenario = RecordedScenario()
    road: RoadScenario = RoadScenario()
    idle: IdleForce = IdleForce()
    tip_in: TipIn = TipIn()
    actuator: ReluctanceActuator = ReluctanceActuator()
    coil: RippleCoil = RippleCoil()
    temperature: TemperatureCoefficients = TemperatureCoefficients()
    mechanics: ClosingMechanics = ClosingMechanics()
    friction: FrictionCoefficients = FrictionCoefficients()
    contact: FrictionContact = FrictionContact()
    vehicle: Vehicle = Vehicle()
    engine: RigidEngine = RigidEngine()
    places: Places = Places()
    hydromount: Hydromount = Hydromount()
    electronics: ElectronicsParameters = ElectronicsParameters()
    faults: Annotated[
        tuple[str, ...],
        Quantity('faults', 'faults from the start on, each NAME@t or NAME@t:duration (s), as in coil_open@8'),
    ] = ()

    @property
    def plant(self) -> Plant:
        """The simulated truth; an unknown mount raises `ParameterError`."""
        parts: dict[str, Any] = {name: getattr(self, name) for name in Plant._fields}
        return Plant(**{**parts, 'mount': seated_mount(self.mount)})


class NodeParameters(NamedTuple):
    """What the node of the simulator takes beside the run that it simulates."""

    answer_patience: Annotated[
        float,
        Quantity('s', 'lock-step: longest wait for the answer to a sample; the first may take any time', 0.0),
    ] = 10.0
    controller_library: Annotated[
        str,
        Quantity('path', 'shared library of the law in C, computed by the electronics too; empty: none'),
    ] = ''
    inject: Annotated[
        str,
        Quantity('faults', 'faults that ~/inject_fault begins, as in coil_open; several with commas between'),
    ] = ''
