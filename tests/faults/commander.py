"""Command a driver from a program of its own: RATE_HZ SIZE, back and forth, until it is killed."""

import sys
import time
from threading import Event

import rclpy
from std_msgs.msg import Float64

HALF_PERIOD_S = 0.1
SAID_EVERY_S = 0.2


def main(rate_hz: float, size: float) -> None:
    """Say how many commands have gone out so far, again and again."""
    rclpy.init()
    never = Event()
    sender = rclpy.create_node("commander").create_publisher(Float64, "pwm", 1)
    while not sender.get_subscription_count():
        never.wait(0.01)
    begin, sent, said_s = time.monotonic(), 0, 0.0
    while True:
        passed_s = time.monotonic() - begin
        sender.publish(Float64(data=size if int(passed_s / HALF_PERIOD_S) % 2 else -size))
        sent += 1
        if passed_s >= said_s:
            print(sent, passed_s, flush=True)
            said_s = passed_s + SAID_EVERY_S
        never.wait(max(sent / rate_hz - passed_s, 0.0))


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
