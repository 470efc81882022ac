"""The verdict of a diagnosis as a frozen record: what verdict.json holds, and what it rests on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pendulum_sysid.records import Localisation, Outcome, Overlay, QualityFinding, Trial
from pendulum_sysid.verdict.drawn import Drawings, Origin
from pendulum_sysid.verdict.scores import FitScores, Remainder
from pendulum_twin.model import Twin

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Interval = tuple[float, float]  # s from the start of the recording


@dataclass(frozen=True)
class VariableShare:
    """Hold the share of what the given twin lacks, its constants refitted, by one variable.

    It is a relation: where the physics acts need not follow from it.

    Attributes:
        variable: name of the variable; a product of variables holds a star.
        finding: the dependence in words.
        share: 0 to 1, of the missing force and torque, that goes with the variable.
    """

    variable: str
    finding: str
    share: float


@dataclass(frozen=True)
class Location:
    """Hold where in the chain from command to sensor the twin is wrong.

    Attributes:
        place: command, drive, cart, pole, sensor or clock.
        evidence: the variables that the missing force and torque go with, the largest share first.
        intervals_s: stretches in which the mismatch is largest; empty for the whole recording.
    """

    place: str
    evidence: tuple[VariableShare, ...]
    intervals_s: tuple[Interval, ...]


@dataclass(frozen=True)
class EffectParameter:
    """Hold the fitted value of one parameter of an effect with its 95 % interval, in `unit`."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class MissingEffect:
    """Hold one effect that the recording shows and the twin as given does not have.

    Attributes:
        effect: name in the catalogue.
        cannot_be_told_from: effects that fit this recording as well in its place.
        confidence: 0 to 1, that this effect is there and none that the recording can tell from it.
        parameters: name of the parameter -> fitted value; empty for an effect that is on or off.
        sentence: the effect with its fitted sizes, for a person.
        replicated: "2 of 3": in how many parts of the recordings that could show the effect it is
            found again; None for an effect that is not asked for again.
        weight: 0 to 1, share of belief in sets that hold the effect; None where none was weighed.
    """

    effect: str
    cannot_be_told_from: tuple[str, ...]
    confidence: float
    parameters: dict[str, EffectParameter]
    sentence: str
    replicated: str | None = None
    weight: float | None = None


@dataclass(frozen=True)
class BelievedSet:
    """Hold a set of effects that was tried, and how much it is believed.

    Attributes:
        effects: names.
        weight: 0 to 1; the share of draws of blocks of time in which the set predicts best.
    """

    effects: tuple[str, ...]
    weight: float


@dataclass(frozen=True)
class MeasuredLaw:
    """Hold one law that has no name in the catalogue and was measured as a curve.

    Attributes:
        law: kind of the law, as in the twin file.
        place: where in the chain from command to sensor it acts.
        variables: over which it is a curve.
        knots: places of the values: evenly spaced over what the recording visited, or the whole
            turn; of a formula up to a quarter of that range more on either side, or about its
            edge; of hysteresis each a fixed ratio above the one before.
        values: at the knots, in `unit`; a formula's where one does as well as the curve.
        low, high: ends of the 95 % intervals of the curve there.
        unit: of the values; "1" for a ratio.
        formula: with its numbers; "" where no formula does as well as the curve.
        sentence: what was measured, for a person.
        shape: name of the formula's shape; "" for none.
        parameters: of the formula -> value with its 95 % interval.
        effective_parameters: how many numbers the curve really uses.
    """

    law: str
    place: str
    variables: tuple[str, ...]
    knots: tuple[float, ...]
    values: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    unit: str
    formula: str
    sentence: str
    shape: str = ""
    parameters: dict[str, EffectParameter] = field(default_factory=dict)
    effective_parameters: float = 0.0


@dataclass(frozen=True)
class RigParameter:
    """Hold one value that the given twin has, before and after the diagnosis, in `unit`.

    Attributes:
        before: value in the twin as given.
        parameters_alone: fitted value without the missing effects.
        after: fitted value with the missing effects; see `Verdict.given_stays`.
        low: lower end of its 95 % interval.
        high: upper end of its 95 % interval.
        unit: of the values.
        identifiable: False where the recording does not fix the value.
        at_bound: True where the fit ended at the limit of the allowed range.
    """

    before: float
    parameters_alone: float
    after: float
    low: float
    high: float
    unit: str
    identifiable: bool
    at_bound: bool


@dataclass(frozen=True)
class Correlations:
    """Hold the correlations of the errors of fitted values.

    Attributes:
        names: (values,) of the fit.
        values: (values, values), -1 to 1; NaN for what the recording does not fix.
    """

    names: tuple[str, ...] = ()
    values: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class NextExperiment:
    """Hold the file name of the plan to play next, beside the verdict, and the reason for it."""

    file: str
    why: str


@dataclass(frozen=True)
class RecordingFacts:
    """Hold what was diagnosed.

    Attributes:
        name: for titles.
        seconds: length.
        samples: number of samples.
        rate_hz: sample rate.
        digest: "sha256:..." of the recording's files.
        position_step_m: step of the cart's encoder; 0 where none shows.
        angle_step_rad: step of the pole's encoder; 0 where none shows.
        visited: lowest and highest value of each variable (`telling.visited`), by its name. Empty
            for a recording that was not used, and in older files.
    """

    name: str
    seconds: float
    samples: int
    rate_hz: float
    digest: str
    position_step_m: float
    angle_step_rad: float
    visited: dict[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Verdict:
    """Hold the answer of a diagnosis.

    The fields down to correlations stand in verdict.json under the same names (`to_dict`).
    The others hold what a report shows beside them; `from_dict` leaves them empty.

    Attributes:
        outcome: how the diagnosis ended.
        sentence: the answer in one sentence, for a person.
        location: where the twin is wrong; None if nothing is missing or the recording is unusable.
        missing_physics: the effects that the twin lacks, each once.
        rig_parameters: name of the rig's constant -> its values before and after.
        masking: sentences about constants that had absorbed a missing effect.
        fit: errors before and after; None if nothing was fitted.
        remainder: what is left above the noise; None if nothing is.
        data_quality: faults in the data of the recording.
        next_experiment: the plan that tells most; None if none is proposed.
        recording: what was diagnosed.
        elapsed_s: duration of the diagnosis.
        warnings: what the reader has to know before the twin is used, a sentence each.
        perhaps: effects of the improved twin that are not sure enough to be named.
        sets: the sets of effects that were tried, the most believed first.
        measured_laws: physics without a name, as curves; the improved twin holds them.
        unlike_rig: True where even the improved twin does not follow the recording.
        effect_parameters: "effect.parameter" of the effects that the given twin has -> its values
            before and after.
        given_stays: True where no other twin runs left-out windows better for sure: the improved
            twin is the given twin, and `after` of its values says what the recording shows alone.
        rig_changed: True where the rig changed between recordings; each by itself is explained.
        correlations: of the errors of the values above.
        command: shell line that made the verdict; "" from Python.
        twin: the improved twin; None if the recording is unusable.
        localisation: the evidence with its shapes, for the fit of the rig's constants alone.
        trials: the sets of effects that were tried, in order.
        overlays: held-out runs of both twins, one record a joint.
        next_plan: the plan as `pendulum_plan/1` holds it.
        origin: when and of which files it was made; None from Python.
        drawings: what a report draws besides; None where nothing was fitted.
        events_s: (begin, end) of the stretches, s, in which something acted on the rig, where all
            that is unexplained stands there and no place of the chain is at fault; else empty.
    """

    outcome: Outcome
    sentence: str
    location: Location | None
    missing_physics: tuple[MissingEffect, ...]
    rig_parameters: dict[str, RigParameter]
    masking: tuple[str, ...]
    fit: FitScores | None
    remainder: Remainder | None
    data_quality: tuple[QualityFinding, ...]
    next_experiment: NextExperiment | None
    recording: RecordingFacts
    elapsed_s: float
    warnings: tuple[str, ...] = ()
    perhaps: tuple[MissingEffect, ...] = ()
    sets: tuple[BelievedSet, ...] = ()
    measured_laws: tuple[MeasuredLaw, ...] = ()
    unlike_rig: bool = False
    effect_parameters: dict[str, RigParameter] = field(default_factory=dict)
    correlations: Correlations = Correlations()
    given_stays: bool = False
    rig_changed: bool = False
    command: str = field(default="", repr=False, compare=False)
    twin: Twin | None = field(default=None, repr=False, compare=False)
    localisation: Localisation | None = field(default=None, repr=False, compare=False)
    trials: tuple[Trial, ...] = field(default=(), repr=False, compare=False)
    overlays: tuple[Overlay, ...] = field(default=(), repr=False, compare=False)
    next_plan: dict[str, Any] | None = field(default=None, repr=False, compare=False)
    origin: Origin | None = field(default=None, repr=False, compare=False)
    drawings: Drawings | None = field(default=None, repr=False, compare=False)
    events_s: tuple[Interval, ...] = field(default=(), repr=False, compare=False)

    def list_given_values(self) -> dict[str, RigParameter]:
        """Return what the given twin has, constants first: name -> values before and after."""
        return {**self.rig_parameters, **self.effect_parameters}

    def to_dict(self) -> dict[str, Any]:
        """Return what verdict.json holds, in JSON's types; None stands for NaN and infinity."""
        from pendulum_sysid.verdict.json_form import encode_verdict

        return encode_verdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Verdict:
        """Return the verdict that verdict.json holds.

        Raises BadInputError naming the key that is missing or of another type.
        """
        from pendulum_sysid.verdict.json_form import decode_verdict

        return decode_verdict(content)

    def plot(self) -> Figure:
        """Return a matplotlib figure: held-out runs before and after, and the missing shapes."""
        from pendulum_sysid.verdict.plot import plot_verdict

        return plot_verdict(self)

    def _repr_html_(self) -> str:
        """Return the verdict as a table, which a notebook shows."""
        from pendulum_sysid.verdict.table import format_verdict

        return format_verdict(self)
