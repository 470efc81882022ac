"""The public functions: recordings or arrays in, records out.

The examples go on from the example of the package, which makes `twin`, `t`, `command`, `noise`,
`run` and `recording`.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from pendulum_sysid import pipeline
from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.fitting.compare import Pair, compare_two
from pendulum_sysid.fitting.compare import compare as compare_case
from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.fitting.parameters import hold_constants
from pendulum_sysid.prepare import prepare, prepare_case
from pendulum_sysid.reading.bag import COMMAND_TOPIC, STATE_TOPIC, read_bag
from pendulum_sysid.reading.raw import RawRecording, check_finite
from pendulum_sysid.records import Comparison, Fit, Recording
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin


class ColumnSource(Protocol):
    """A pandas frame, or a mapping, with the columns t, command, cart and pole."""

    def get(self, key: str) -> Any:
        """Return a column, None if it is absent."""


Source = Recording | str | Path | ColumnSource
Sources = Source | Sequence[Source]


def read_recording(
    path: str | Path, state_topic: str = STATE_TOPIC, command_topic: str = COMMAND_TOPIC
) -> Recording:
    """Read a rosbag2 recording and clean it.

    Args:
        path: rosbag2 folder, mcap or sqlite3, or a single data file of one.
        state_topic: topic of the joint states, `sensor_msgs/JointState`.
        command_topic: topic of the commands, `std_msgs/Float64`.

    Returns:
        The recording on one uniform clock, and the faults in its data.

    Raises:
        FileError: there is no recording at the path.
        BadInputError: the recording is too short to be used.

    Examples:
        >>> ps.read_recording("nowhere")  # doctest: +IGNORE_EXCEPTION_DETAIL
        Traceback (most recent call last):
        pendulum_sysid.errors.FileError: nowhere: expected a recording ...
    """
    return clean_recording(read_bag(path, state_topic, command_topic))


def make_recording(
    t: ArrayLike,
    command: ArrayLike | None,
    cart: ArrayLike | None,
    pole: ArrayLike | None,
    name: str = "arrays",
) -> Recording:
    """Make a recording from arrays; see `Recording.from_arrays`."""
    times = _read_numbers("t", t)
    if times.ndim != 1:
        raise BadInputError(
            f"expected t with one dimension, found an array of shape {times.shape}: give a time "
            "for each sample"
        )
    check_finite(times)
    stamps = times - times[:1]
    channels = [
        None if values is None else _read_numbers(label, values)
        for label, values in (("command", command), ("cart", cart), ("pole", pole))
    ]
    for label, values in zip(("command", "cart", "pole"), channels, strict=True):
        if values is not None and values.shape != times.shape:
            raise BadInputError(
                f"expected {label} with the shape of t, {times.shape}, found {values.shape}"
            )
    digest = hashlib.sha256(b"".join(v.tobytes() for v in (times, *channels) if v is not None))
    command_values, cart_m, pole_rad = channels
    raw = RawRecording(
        name=name,
        digest=f"sha256:{digest.hexdigest()}",
        state_stamp_s=stamps,
        cart=cart_m,
        pole=pole_rad,
        command_stamp_s=np.empty(0) if command_values is None else stamps,
        command=np.empty(0) if command_values is None else command_values,
    )
    return clean_recording(raw)


def diagnose(
    recordings: Sources,
    twin: Twin | str | Path,
    progress: Callable[[str], None] | None = None,
    hold: str | Sequence[str] = (),
) -> Verdict:
    """Find what a twin lacks, from one or several recordings of the rig.

    Args:
        recordings: a recording, the path of a bag, a pandas frame with the columns t, command,
            cart and pole, or a list of these.
        twin: the twin as believed, or the path of its file.
        progress: called with a line of text at every step of the search.
        hold: constants of the rig that are known and stay as they are, a name or several;
            "all" for all of them.

    Returns:
        The verdict: outcome, missing effects with intervals, constants of the rig before and
        after, and the improved twin.

    Raises:
        BadInputError: the recordings do not fit together, or hold a joint that the twin lacks.

    Examples:
        >>> verdict = ps.diagnose(recording, twin)
        >>> verdict.outcome
        <Outcome.NOTHING_MISSING: 'nothing_missing'>
        >>> verdict.missing_physics
        ()
        >>> round(verdict.rig_parameters["force_per_pwm_n"].after)
        13
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a run that overflows is judged, not warned of
        known = hold_constants(_get_twin(twin), hold)
        return pipeline.diagnose(_read_all(recordings), known, progress or _ignore)


def fit(recordings: Sources, twin: Twin | str | Path) -> Fit:
    """Fit the constants of the rig and the effects of a twin to recordings.

    Args:
        recordings: as `diagnose` takes them.
        twin: where the fit starts; its effects are fitted, none is added.

    Returns:
        The fit: the fitted twin, and every estimate with its 95 % interval.

    Raises:
        BadInputError: the recordings do not fit the twin or cannot be used.

    Examples:
        >>> fitted = ps.fit(recording, twin)
        >>> sorted(fitted.estimates)[:2]
        ['cart_viscous_n_s_m', 'com_distance_m']
        >>> estimate = fitted.estimates["cart_viscous_n_s_m"]
        >>> bool(estimate.low < estimate.value < estimate.high)
        True
    """
    prepared = prepare(_read_all(recordings), _get_twin(twin))
    return fit_own_parameters(prepared.case, prepared.split)


def replay(recordings: Sources, twin: Twin | str | Path) -> Comparison:
    """Run a twin over a recording and measure its errors.

    Args:
        recordings: as `diagnose` takes them.
        twin: the twin to run.

    Returns:
        The errors of free runs over windows of 1 s, and of one free run over the whole.

    Raises:
        BadInputError: the recordings do not fit the twin or hold no usable window.

    Examples:
        >>> errors = ps.replay(recording, twin)
        >>> errors.count, errors.seconds
        (22, 1.0)
        >>> errors.pole_rmse_rad < 0.05
        True
    """
    return compare_case(prepare_case(_read_all(recordings), _get_twin(twin)))


def compare(recordings: Sources, first: Twin | str | Path, second: Twin | str | Path) -> Pair:
    """Run two twins over the same windows of a recording.

    Args:
        recordings: as `diagnose` takes them.
        first: a twin.
        second: another twin of the same rig.

    Returns:
        The errors of both twins (`comparisons`), and the number of windows in which the second
        twin has the smaller error (`second_better`).

    Raises:
        BadInputError: the recordings do not fit the twins or hold no usable window.

    Examples:
        >>> pair = ps.compare(recording, twin, fitted.twin)
        >>> pair.comparisons[0].count == pair.comparisons[1].count
        True
    """
    case = prepare_case(_read_all(recordings), _get_twin(first))
    return compare_two(case, _get_twin(second))


def _read_numbers(label: str, values: ArrayLike) -> Floats:
    """Return an argument as an array; raise BadInputError where it holds anything but numbers."""
    try:
        kind = np.asarray(values).dtype
        if kind.kind in "mM":
            raise ValueError(f"values of type {kind}")
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise BadInputError(
            f"expected {label} to be numbers, found {error}: give seconds, m, rad or the command "
            "as floats"
        ) from error


def _read_all(recordings: Sources) -> list[Recording]:
    if isinstance(recordings, Sequence) and not isinstance(recordings, str):
        if not recordings:
            raise WrongUse("expected at least one recording, found none: give one or several")
        return [_read(source) for source in recordings]
    return [_read(recordings)]


def _read(source: Source) -> Recording:
    if isinstance(source, Recording):
        return source
    if isinstance(source, str | Path):
        return read_recording(source)
    t, command, cart, pole = (source.get(name) for name in ("t", "command", "cart", "pole"))
    if t is None:
        raise BadInputError("expected a column t with the sampling times in s, found none")
    return make_recording(t, command, cart, pole)


def _get_twin(twin: Twin | str | Path) -> Twin:
    return twin if isinstance(twin, Twin) else load_twin(twin)


def _ignore(line: str) -> None:
    """Ignore a line of progress."""
