"""The verb `effects`: the catalogue, or what a planned recording will show of it."""

from __future__ import annotations

import argparse

from pendulum_sysid.telling.catalogue_text import format_catalogue, make_catalogue_mapping
from pendulum_sysid.verbs.said import ANSWERED, print_answer


def run(arguments: argparse.Namespace) -> int:
    """Print the catalogue, or with `--isolability` what a plan's recording can tell apart."""
    if arguments.isolability:
        return _print_isolability(arguments)
    if arguments.twin is not None or arguments.plan is not None:
        arguments.parser.error("--twin and --plan go with --isolability")
    print_answer(arguments, make_catalogue_mapping, format_catalogue())
    return ANSWERED


def _print_isolability(arguments: argparse.Namespace) -> int:
    # here, for the list above is to come at once
    from pendulum_sysid.planning.isolability import Encoders, predict_isolability
    from pendulum_sysid.telling.isolability_text import (
        format_isolability,
        make_isolability_mapping,
    )
    from pendulum_twin.model import load_twin
    from pendulum_twin.plans.excitation import make_standard_plan
    from pendulum_twin.plans.plan_file import load_plan
    from pendulum_twin.plans.waveforms import make_envelope

    if arguments.twin is None or arguments.plan is None:
        arguments.parser.error("--isolability needs --twin and --plan")
    twin = load_twin(arguments.twin)
    room = make_envelope(twin.rig)
    plan = (
        make_standard_plan(room)
        if arguments.plan == "standard"
        else load_plan(arguments.plan, room)
    )
    answer = predict_isolability(
        twin,
        plan,
        Encoders(arguments.pole_counts, arguments.cart_step_m),
        report=arguments.progress.report,
    )
    print_answer(arguments, lambda: make_isolability_mapping(answer), format_isolability(answer))
    return ANSWERED
