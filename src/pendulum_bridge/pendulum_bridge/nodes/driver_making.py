"""Make the driver that the settings of `driver_node` ask for."""

from __future__ import annotations

from pendulum_bridge.driver.driver import Driver
from pendulum_bridge.driver.last_word import LastWord
from pendulum_bridge.nodes.driver_outlet import DriverOutlet
from pendulum_bridge.nodes.driver_settings import DriverSettings
from pendulum_bridge.safety.limits import Limits
from pendulum_bridge.safety.signs import find_ways
from pendulum_bridge.safety.state import Rules, make_rules
from pendulum_bridge.safety.watchdog import Timeouts
from pendulum_bridge.wire.link import Link
from pendulum_bridge.wire.protocol import Command
from pendulum_bridge.wire.tcp import open_tcp_link
from pendulum_bridge.wire.udp import Address
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin


def make_driver(settings: DriverSettings, twin: Twin, outlet: DriverOutlet) -> Driver:
    """Return the driver of a rig, not active yet.

    Raises BadInputError when the rig cannot be driven or reached.
    """
    rules, link = collect_rules(settings, twin), make_link(settings)
    try:
        last_word = LastWord(link, Command(0.0).pack())
        return Driver(
            link, rules, outlet, last_word, lossless=settings.transport == "tcp", active=False
        )
    except BadInputError:
        link.close()
        raise


def make_link(settings: DriverSettings) -> Link:
    """Return the link to the rig; raise BadInputError when an address cannot be used."""
    rig = Address(settings.rig_host, settings.rig_port)
    if settings.transport == "tcp":
        return open_tcp_link(rig)
    return Link(Address(settings.listen_host, settings.listen_port), rig)


def collect_rules(settings: DriverSettings, twin: Twin) -> Rules:
    """Return the rules of the decisions; raise BadInputError for a rig that cannot be driven."""
    way, pole_way = find_ways(twin.effects)
    return make_rules(
        twin.rig,
        Limits(settings.pwm_limit, settings.slew_per_s),
        Timeouts(*settings.timeouts_s),
        way,
        pole_way,
        1 / settings.rate_hz,
        settings.reset_deadline_s,
    )


def describe_limits(rules: Rules, settings: DriverSettings) -> str:
    """Return the limits that hold, in a sentence."""
    limit, wanted = rules.limits.magnitude, settings.pwm_limit
    lower = f" (the twin file's, below pwm_limit {wanted:g})" if limit < wanted else ""
    return (
        f"limits: PWM {limit:g}{lower}, slew {rules.limits.slew_per_s:g} /s, "
        f"PWM 0 after {rules.timeouts.command_s:g} s without a command or "
        f"{rules.timeouts.sample_s:g} s without a sample, "
        f"cart within {rules.guard.end_m:g} m of the middle, {settings.rate_hz:g} samples/s"
    )
