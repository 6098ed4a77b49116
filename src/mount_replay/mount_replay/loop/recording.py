"""A simulated drive without middleware, recorded in the topics of the graph."""

import time
from collections.abc import Callable
from pathlib import Path

from mount_bags.bag.split import WHOLE, SplitRule
from mount_bags.bag.writer import BagWriter
from mount_bags.run.session import session_message
from mount_bringup.chosen import Parameters
from mount_replay.loop.run import CoreOutcome, run_core
from mount_ros.topics import SESSION, TOPICS, Delivery, Topic
from mount_sim.excitation.excitation import Excitation


def record_core(
    folder: Path,
    parameters: Parameters,
    session: str,
    progress: Callable[[float], None] = lambda share: None,
    *,
    excitation: Excitation | None = None,
    namespace: str = '',
    split: SplitRule = WHOLE,
) -> CoreOutcome:
    """Run the scenario in `parameters`, write it to the recording `folder`, and return what happened.

    `session` is the text of the session message; `progress` takes the share that is done. `excitation`
    is that of the scenario where it is built already.
    """
    writer = BagWriter(folder, split=split)
    prefix = f'/{namespace.strip("/")}/' if namespace else '/'
    names = {topic.name: _full_name(topic, prefix) for topic in TOPICS}
    for topic in TOPICS:
        writer.add_topic(names[topic.name], topic.type, latched=topic.delivery is Delivery.LATCHED)
    begin = time.time_ns()
    try:
        writer.write(names[SESSION.name], session_message(session), begin)
        return run_core(
            parameters,
            lambda topic, raw, stamp: writer.write(names[topic.name], raw, begin + stamp),
            progress,
            lambda columns, stamps: writer.write_columns(
                [names[topic.name] for topic, _ in columns], [rows for _, rows in columns], begin + stamps
            ),
            excitation,
        )
    finally:
        writer.close()


def _full_name(topic: Topic, prefix: str) -> str:
    return topic.name if topic.name.startswith('/') else prefix + topic.name
