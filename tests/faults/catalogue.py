"""All faults, in the order of the table."""

from collections.abc import Callable

from faults import apart, commands, packets, programs, users
from faults.bench import Bench
from faults.row import Row
from support.ros_graph import Graph

ON_BENCH: tuple[Callable[[Bench], Row], ...] = (
    commands.stale_command,
    commands.learner_pauses,
    commands.flood,
    commands.not_a_number,
    commands.infinity,
    commands.huge,
    commands.two_writers,
    packets.nan_packets,
    packets.random_packets,
    packets.short_packets,
    packets.foreign_packets,
    packets.reordered_packets,
    packets.silence,
    packets.rig_restarts,
    packets.encoder_jump,
    packets.encoder_stuck,
    packets.same_sample,
    programs.driver_stopped,
    programs.driver_killed,
    programs.companion_killed,
    programs.companion_stopped,
    programs.stop,
    programs.stop_in_reset,
    packets.silence_in_reset,
    programs.wrong_parameters,
    users.computer_stands_still,
    users.deactivated_under_load,
)
APART: tuple[Callable[[Graph], Row], ...] = (
    programs.wrong_at_start,
    users.wrong_parameter_file,
    users.cold_start_interrupted,
    users.no_clock,
    users.plan_given_up,
    apart.ros_clock_jumps,
    apart.empty_sample,
    apart.mirrored_encoder,
    apart.resets,
)
