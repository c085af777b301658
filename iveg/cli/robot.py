"""``iveg robot`` connects a ROS 2 robot; ``iveg robot check`` reports its problems."""

import asyncio
from collections import Counter
from dataclasses import replace

from iveg.adapters import clock
from iveg.adapters.dds_network import DdsNetwork
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.cli.arguments import CommandCall
from iveg.cli.nodes import broker_of, load_config, network_of, node_settings
from iveg.cli.running import (
    LOOPBACK,
    report_ready,
    run_until_stopped,
    tune_garbage_collection,
)
from iveg.domain.errors import HopError, SettingsError, UnreadableError
from iveg.domain.fleet import (
    UNDESCRIBED_SPEED,
    RobotDescription,
    RobotProfile,
    is_robot_id,
)
from iveg.domain.laser import Plan
from iveg.robot.ros2.checking import CheckRow, judge, lines
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.inputs import SensorInputs, Subscriptions
from iveg.robot.ros2.outputs import Network
from iveg.robot.ros2.rig import Ros2Robot
from iveg.ros2 import cdr
from iveg.ros2.messages import Message
from iveg.settings import Settings

_CHECK_S = 4.0
_CHECK_DEPTH = 200


async def check(
    robot_id: str,
    config: RobotConfig,
    inputs: SensorInputs,
    network: DdsNetwork,
    settings: Settings,
) -> int:
    """Listen without publishing, and print problems; returns 1 where there are any."""
    from iveg.adapters.dds import Dds

    counts, frames = Counter[str](), dict[str, str]()
    fleet = load_fleet(settings.fleet, settings.robots)
    with Dds(network) as dds:
        subscriptions = Subscriptions(config, dds, _CHECK_DEPTH)
        began = clock.mono()
        while clock.mono() - began < _CHECK_S:
            subscriptions.meet(dds.endpoints())
            await asyncio.sleep(0.03)
            now = clock.now()
            for topic, form, payloads in subscriptions.take():
                counts[topic] += len(payloads)
                frames[topic] = _frame(form, payloads[-1])
                inputs.receive(topic, payloads, now.mono, form)
            inputs.tick(now)
        rows = judge(
            config,
            dds.endpoints(),
            {key: (n / _CHECK_S, frames[key]) for key, n in counts.items()},
            inputs.input_faults.faults(clock.mono()),
            robot_id=robot_id,
            has_detector=fleet.of_robot(robot_id).has_detector,
        )
    if robot_id not in fleet.ids:
        known = f"not in the fleet of IVEG_ROBOTS: {', '.join(fleet.ids)}"
        rows += (CheckRow(robot_id, verdict=known),)
    missing = any(row.verdict for row in rows)
    print("\n".join([*lines(rows), "" if missing else "Nothing is missing."]))
    return 1 if missing else 0


def _frame(form: type[Message], payload: bytes) -> str:
    """Frame of a message; empty where it has none or cannot be read."""
    try:
        header = getattr(cdr.read(form, payload), "header", None)
    except UnreadableError:
        return ""
    return "" if header is None else str(header.frame_id)


def run(call: CommandCall) -> int:
    """Run ``iveg robot``; returns the exit code."""
    options, settings = call.options, call.settings
    if not is_robot_id(options.id):
        allowed = "1 to 64 letters, digits and hyphens, and no name of iVeg's own"
        raise SettingsError("--id", options.id, allowed)
    config = load_config(options, call.environment)
    network = network_of(config, call.environment, "iveg robot")
    if options.action == "check":
        inputs = SensorInputs(config, sim_time=options.sim_time)
        return asyncio.run(check(options.id, config, inputs, network, settings))
    if options.attended and broker_of(settings).host not in LOOPBACK:
        raise SettingsError(
            "--attended", broker_of(settings).host, "used with a broker on loopback"
        )
    from iveg.adapters.files import lease

    with lease(call.data / "robots" / f"{options.id}.lease", options.id):
        work = _ride(call, config, network)
        return run_until_stopped(work, until_eof=options.until_eof)


async def _ride(
    call: CommandCall,
    config: RobotConfig,
    network: DdsNetwork,
) -> None:
    from iveg.adapters.dds import Dds

    options, settings = call.options, call.settings
    plan = None
    if options.greenhouse is not None:
        # The laser need not report what the plan shows.
        plan = Plan.from_greenhouse(load_greenhouse(options.greenhouse))
    described = load_fleet(settings.fleet, settings.robots).of_robot(options.id)
    with Dds(network, gate=options.id) as dds:
        # Before any endpoint of ours: two gates would both drive the base.
        await refuse_second_gate(dds, config.full_topics["cmd_vel_out"])
        robot = Ros2Robot(
            options.id,
            config,
            dds,
            SensorInputs(config, sim_time=options.sim_time),
            node_settings(settings, call.data / "robots", plan),
            _profile(described, config),
        )
        if options.attended:
            robot.node.release_locally()
        tune_garbage_collection()
        report_ready()
        await robot.run()


def _profile(robot: RobotDescription, config: RobotConfig) -> RobotProfile:
    """Speed limits of the gate; a robot without description is slow."""
    known = robot.profile
    speed = known.max_speed if robot.is_described else UNDESCRIBED_SPEED
    return replace(
        known,
        max_speed=config.drive.max_speed or speed,
        max_turn=config.drive.max_turn or known.max_turn,
    )


async def refuse_second_gate(
    dds: Network, topic: str, discovery_s: float = 2.0, ghost_s: float = 6.0
) -> None:
    """Refuse a drive topic that another program publishes on.

    Args:
        dds: The DDS network.
        topic: Topic of the drive.
        discovery_s: Time of discovery (s).
        ghost_s: Time after which a publisher counts (s): a killed gate is still
            announced for its lease of 3 s.

    Raises:
        HopError: another program publishes on the topic.
    """
    began = clock.mono()
    await asyncio.sleep(discovery_s)
    while any(
        end.writes and end.topic == topic and not end.own for end in dds.endpoints()
    ):
        if clock.mono() - began > ghost_s:
            raise HopError(
                "dds",
                f"{topic} has a publisher already: another gate, or a navigation that "
                "goes round it; only one program may drive this robot",
            )
        await asyncio.sleep(0.1)
