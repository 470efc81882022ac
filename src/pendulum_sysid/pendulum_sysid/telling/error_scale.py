"""One scale of error, times the noise floor, and a picture of 1 mm and 1 degree on a rig."""

from __future__ import annotations

import math
from dataclasses import dataclass

from markupsafe import Markup

from pendulum_sysid.telling.display import format_quantity, render_number
from pendulum_sysid.verdict.record import Verdict
from pendulum_sysid.verdict.scores import BeforeAfter, FitScores

WIDTH, HEIGHT = 300, 150  # of a picture, in units of its own
REACH = 5.0  # errors after, to either side, that a picture shows
LEAST_MM, LEAST_DEGREES = 1.0, 1.0  # that a picture shows at least
ARM = 105.0  # length of the drawn pole, units
LEAST_ENLARGED = 5.0  # times, from which a single degree is drawn as the rule


@dataclass(frozen=True)
class ScaleMark:
    """Hold a mark on the scale of error.

    words: what reaches this error.
    floors: the error in noise floors.
    place: 0 to 100 on a logarithmic axis.
    means: the same error on the rig, in mm and degrees; "" where it is not known.
    """

    words: str
    floors: float
    place: float
    means: str


def list_marks(verdict: Verdict) -> tuple[ScaleMark, ...]:
    """Return the marks of the scale: a perfect model, the improved twin, the twin as given."""
    fit = verdict.fit
    if fit is None or not fit.noise_floor > 0.0:
        return ()
    change = get_floors(fit)
    errors = [
        ("a perfect model", 1.0, ""),
        ("after: the improved twin", change.after, _describe(fit, "after")),
        ("before: the twin as given", change.before, _describe(fit, "before")),
    ]
    ratios = [ratio for _, ratio, _ in errors]
    finite = [math.log10(ratio) for ratio in ratios if math.isfinite(ratio) and ratio > 0.0]
    most = max([1.0, *finite])
    least = min([0.0, *finite])
    return tuple(
        ScaleMark(words, ratio, _put(ratio, least, most), means)
        for (words, _, means), ratio in zip(errors, ratios, strict=True)
    )


def get_floors(fit: FitScores) -> BeforeAfter:
    """Return the errors before and after in noise floors; scores' own in older files."""
    if fit.floors is not None:
        return fit.floors
    size = fit.noise_floor or 1.0
    return BeforeAfter(fit.held_out.before / size, fit.held_out.after / size)


def _put(ratio: float, least: float, most: float) -> float:
    if not math.isfinite(ratio):
        return 100.0
    return round(100.0 * (math.log10(max(ratio, 1e-9)) - least) / (most - least), 2)


def _describe(fit: FitScores, when: str) -> str:
    cart, pole = fit.held_out_cart_mm, fit.held_out_pole_rad
    texts = []
    if cart is not None:
        texts.append(f"the cart is {format_quantity(getattr(cart, when), 'mm')} off")
    if pole is not None:
        degrees = math.degrees(getattr(pole, when))
        texts.append(f"the pole {render_number(degrees)}°")
    return ", ".join(texts)


def draw_meaning(verdict: Verdict) -> tuple[Markup, ...]:
    """Return a picture of the held-out error of each joint, to scale."""
    fit = verdict.fit
    if fit is None:
        return ()
    pictures = []
    if fit.held_out_cart_mm is not None:
        cart = fit.held_out_cart_mm
        pictures.append(_draw_cart(cart.before, cart.after))
    if fit.held_out_pole_rad is not None:
        pole = fit.held_out_pole_rad
        pictures.append(_draw_pole(math.degrees(pole.before), math.degrees(pole.after)))
    return tuple(Markup(picture) for picture in pictures)


def _draw_cart(before: float, after: float) -> str:
    """Return the cart as measured and as both twins have it, mm to scale."""
    shown = max(REACH * (after if math.isfinite(after) else 1.0), LEAST_MM)
    scale = 80.0 / shown  # units a mm
    ghosts = "".join(
        f'<rect x="{110 + _limit(error * scale, 90):.2f}" y="55" width="80" height="36" rx="4" '
        f'fill="none" {look}/>'
        for error, look in _list_looks(before, after)
    )
    rule = _choose_rule(shown)
    label = f"Error of the cart: {_say(before, 'mm')} before, {_say(after, 'mm')} after"
    return (
        f'<svg role="img" aria-label="{label}" viewBox="0 0 {WIDTH} {HEIGHT}">'
        f'<path d="M10 91H290" stroke="var(--soft)"/>'
        f'<rect x="110" y="55" width="80" height="36" rx="4" fill="var(--pale)"/>{ghosts}'
        f'<path d="M110 112v8h{rule * scale:.2f}v-8" fill="none" stroke="var(--ink)"/>'
        f'<text x="110" y="138">{rule:g} mm</text>'
        f"{_write_notes(before * scale > 90, label, 14)}</svg>"
    )


def _draw_pole(before: float, after: float) -> str:
    """Return the pole hanging as measured and as both twins have it; small angles are enlarged."""
    shown = max(REACH * (after if math.isfinite(after) else 1.0), LEAST_DEGREES)
    scale = min(max(1.0, 40.0 / shown), 40.0)
    lines = "".join(
        f'<path d="M150 20L{150 + ARM * math.sin(math.radians(angle)):.2f} '
        f'{20 + ARM * math.cos(math.radians(angle)):.2f}" fill="none" {look}/>'
        for angle, look in [
            (_limit(error * scale, 80.0), look) for error, look in _list_looks(before, after)
        ]
    )
    label = f"Error of the pole: {_say(before, '°')} before, {_say(after, '°')} after"
    enlarged = f", angles drawn {scale:.3g} times as large" if scale > 1.05 else ""
    degrees = 1.0 if scale >= LEAST_ENLARGED else 10.0
    rule = math.radians(degrees * scale)
    return (
        f'<svg role="img" aria-label="{label}" viewBox="0 0 {WIDTH} {HEIGHT}">'
        f'<path d="M110 20H190" stroke="var(--soft)"/>'
        f'<path d="M150 20V{20 + ARM:g}" stroke="var(--pale)" stroke-width="6"/>{lines}'
        f'<path d="M150 90A70 70 0 0 1 {150 - 70 * math.sin(rule):.2f} '
        f'{20 + 70 * math.cos(rule):.2f}" fill="none" stroke="var(--ink)"/>'
        f'<text x="{142 - 72 * math.sin(rule):.2f}" y="100" text-anchor="end">{degrees:g}°</text>'
        f"{_write_notes(before * scale > 80, label + enlarged, 145)}</svg>"
    )


def _list_looks(before: float, after: float) -> list[tuple[float, str]]:
    looks = (
        (before, 'stroke="var(--ink)" stroke-dasharray="5 3" stroke-width="1.5"'),
        (after, 'stroke="var(--accent)" stroke-width="2"'),
    )
    return [(error, look) for error, look in looks if not math.isnan(error)]


def _limit(length: float, most: float) -> float:
    return min(length, most) if math.isfinite(length) else most


def _write_notes(is_cut: bool, label: str, y: int) -> str:
    words = "before: further than the picture reaches" if is_cut else ""
    return f"<title>{label}</title>" + (f'<text x="290" y="{y}" text-anchor="end">{words}</text>')


def _choose_rule(shown: float) -> float:
    """Return a round length, mm, a tenth to half of what is shown; 1 mm wherever that fits."""
    most = shown / 2.0
    if most / 5.0 <= 1.0 <= most:
        return 1.0
    power = 10.0 ** math.floor(math.log10(most))
    return next(step * power for step in (5.0, 2.0, 1.0) if step * power <= most)


def _say(value: float, unit: str) -> str:
    return f"{render_number(value)}{'' if unit == '°' else ' '}{unit}"
