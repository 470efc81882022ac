"""End the launch with a status other than 0 when a program of it fails.

Included by identify.launch.xml: XML can end a launch with a program, but not as a failure. An
exception in the handler of an event is what `ros2 launch` ends with status 1 for.
"""

from launch import LaunchDescription
from launch.actions import RegisterEventHandler
from launch.event_handlers import OnProcessExit


def generate_launch_description() -> LaunchDescription:
    """Return the handler of programs that end."""
    return LaunchDescription([RegisterEventHandler(OnProcessExit(on_exit=report_failure))])


def report_failure(event, context) -> None:
    """Raise RuntimeError for a program that failed by itself, not by the end of the launch."""
    if event.returncode and not context.is_shutdown:
        raise RuntimeError(
            f"{event.process_name} ended with status {event.returncode}: "
            "the experiment is given up"
        )
