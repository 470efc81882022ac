"""Kill programs that start and publish, and count how often that freezes others.

    python tests/faults/killed_neighbours.py [--rounds 20] [--seed 0] [--shared-memory]

Nine programs publish and hear one topic. Six are killed (SIGKILL) at random instants, the first
while they start. The other three end by themselves four seconds after they began to publish,
unless they wait for a lock that a killed program left.
"""

import argparse
import os
import random
import subprocess
import sys
import time
from pathlib import Path

import rclpy
from sensor_msgs.msg import JointState

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from support.ros_graph import free_domain

from pendulum_twin.nodes.transport import RANGE, leave_shared_memory

TALK = "talk"
TALK_S = 4.0
PAUSE_S = (0.4, 0.9)  # before each kill
FROZEN_S = 60.0  # nobody needs so long to start, talk and end
KILLED, LEFT = 6, 3


def talk(name: str) -> None:
    """Publish and hear for four seconds."""
    rclpy.init()
    node = rclpy.create_node(name)
    sender = node.create_publisher(JointState, "samples", 10)
    node.create_subscription(JointState, "samples", lambda _: None, 10)
    end_s = time.monotonic() + TALK_S
    while time.monotonic() < end_s:
        sender.publish(JointState(name=["cart", "pole"], position=[0.0, 0.0]))
        rclpy.spin_once(node, timeout_sec=0.0005)
    node.destroy_node()
    rclpy.shutdown()


def play_round(environment: dict[str, str], chance: random.Random) -> bool:
    """Return whether a program froze."""
    command = [sys.executable, __file__, TALK]
    programs = [
        subprocess.Popen([*command, f"talker_{number}"], env=environment)
        for number in range(KILLED + LEFT)
    ]
    try:
        for program in programs[:KILLED]:
            time.sleep(chance.uniform(*PAUSE_S))
            program.kill()
        end_s = time.monotonic() + FROZEN_S
        for program in programs[KILLED:]:
            program.wait(max(end_s - time.monotonic(), 0.0))
    except subprocess.TimeoutExpired:
        return True
    finally:
        for program in programs:
            program.kill()
            program.wait()
    return False


def main() -> None:
    """Say after every round how many had a frozen program so far."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shared-memory", action="store_true")
    options = parser.parse_args()
    chance, frozen = random.Random(options.seed), 0
    with free_domain() as domain:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), RANGE: "LOCALHOST"}
        if not options.shared_memory:
            leave_shared_memory(environment)
        for number in range(1, options.rounds + 1):
            frozen += play_round(environment, chance)
            print(f"rounds with a frozen program: {frozen} of {number}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == [TALK]:
        talk(sys.argv[2])
    else:
        main()
