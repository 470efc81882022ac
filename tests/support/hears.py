"""Say when a sample is heard on TOPIC, with the middleware's own transports, until killed."""

import sys

import rclpy
from sensor_msgs.msg import JointState


def main(topic: str) -> None:
    """Print "heard" for every sample."""
    rclpy.init()
    listener = rclpy.create_node("listener")
    listener.create_subscription(JointState, topic, lambda _: print("heard", flush=True), 10)
    rclpy.spin(listener)


if __name__ == "__main__":
    main(sys.argv[1])
