"""The simulator's verdict on itself, from figures alone."""

from mount_models.sampling import SAMPLE_TIME
from mount_ros.diagnostics import Level, Verdict
from mount_sim.loop import LoopFigures
from mount_sim.simulated_mount import Run

DRIVING, FINISHED = 'driving', 'finished'
LATE_SHARE = 0.05  # chosen: of the samples; beyond it the machine is too busy for real time


def verdict(figures: LoopFigures, run: Run, *, lockstep: bool) -> Verdict:
    """Return level and sentence; the figures carry the progress of the run."""
    samples = figures.samples  # goes on while this is written
    simulated = samples * SAMPLE_TIME
    values = {
        'samples': samples,
        'samples_of_run': run.samples,
        'simulated_s': f'{simulated:.3f}',
        'excitation_start_s': f'{run.excitation_start * SAMPLE_TIME:.3f}',
        'real_time_factor': f'{simulated / figures.wall_time:.4f}' if figures.wall_time > 0.0 else 'nan',
        'answered': figures.answered,
        'overruns': figures.overruns,
        'latency_median_s': f'{figures.latency.quantile(0.5):.7f}',
        'latency_p99_s': f'{figures.latency.quantile(0.99):.7f}',
        'fatal': bool(figures.failure),
    }
    if figures.failure:
        values['waiting_stamp'] = round((samples - 1) * SAMPLE_TIME * 1e9)
        return Verdict(Level.ERROR, figures.failure, values)
    if samples >= run.samples:
        return Verdict(Level.OK, FINISHED, values)
    if not lockstep and figures.overruns > LATE_SHARE * max(samples, 1000):
        return Verdict(
            Level.WARN,
            f'{figures.overruns} of {samples} samples were late (limit {100 * LATE_SHARE:g} %): this machine '
            'is too busy for real time; close other programs, or use lock-step',
            values,
        )
    return Verdict(Level.OK, DRIVING, values)
