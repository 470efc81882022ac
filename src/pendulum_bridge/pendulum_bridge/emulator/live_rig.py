"""An emulated rig that takes the protocol's commands and gives the protocol's samples."""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.emulator.swing_down import Phase, SwingDown, advance, make_tuning
from pendulum_bridge.wire.protocol import Command, Sample


class LiveRig:
    """Hold the last command for ever, as the real rig does; before the first command PWM is 0.

    A rising edge of the reset flag starts the swing-down anew. While it runs, commands are stored
    and not obeyed; when it is over, the last command acts again.
    concealed: rig, effects and unlisted physics.
    rate_hz: samples a second.
    encoders, seed: see `EmulatedRig`.
    """

    def __init__(
        self,
        concealed: Concealed,
        rate_hz: float = 100.0,
        encoders: Encoders = Encoders(),  # noqa: B008 (frozen)
        seed: int = 0,
    ) -> None:
        self._settings = rate_hz, encoders, seed
        self._rig = EmulatedRig(concealed, *self._settings)
        self._tuning = make_tuning(concealed.rig, concealed.effects)
        self._command = Command(0.0)
        self._swing_down: SwingDown | None = None
        self._changed: Concealed | None = None

    @property
    def period_s(self) -> float:
        """Return the sample period in s of the rig's own time."""
        return self._rig.period_s

    @property
    def sample(self) -> Sample:
        """Return the last sample."""
        cart_m, pole_rad, cart_velocity, pole_rate = (float(value) for value in self._rig.sample)
        return Sample(pole_rad, pole_rate, cart_m, cart_velocity)

    @property
    def is_swinging_down(self) -> bool:
        """Return whether a swing-down runs."""
        return self._swing_down is not None

    def take(self, command: Command) -> None:
        """Hold the command from now on."""
        if command.reset and not self._command.reset:
            self._swing_down = SwingDown()
        self._command = command

    def change(self, changed: Concealed) -> None:
        """Go on as another rig from the next sample period; a signal handler may call this.

        The motion goes on; the other rig's drive and sensors remember nothing.
        """
        self._changed = changed

    def step(self, later: Sequence[tuple[float, Command]] = ()) -> Sample:
        """Move on by one sample period and return the sample at its end.

        later: commands that come within the period: the share of it after which each acts, rising.
        """
        if self._changed is not None:
            self._exchange_rig(self._changed)
        pwm, changes = self._choose_pwm(), []
        for share, command in later:
            self.take(command)
            if not self.is_swinging_down:
                changes.append((share, command.pwm))
        self._rig.step(pwm, changes)
        return self.sample

    def _exchange_rig(self, changed: Concealed) -> None:
        start = tuple(self._rig.truth.tolist())
        self._rig = EmulatedRig(changed, *self._settings, start=start)
        self._tuning, self._changed = make_tuning(changed.rig, changed.effects), None

    def _choose_pwm(self) -> float:
        if self._swing_down is not None:
            self._swing_down, pwm = advance(
                self._swing_down, self._rig.truth, self._tuning, self.period_s
            )
            if self._swing_down.phase is Phase.RUNNING:
                return pwm
            self._swing_down = None
        return self._command.pwm
