"""Examples at the end of the help of every verb; a verb of `fleet` stands behind it."""

from __future__ import annotations

EXAMPLES: dict[str, tuple[str, ...]] = {
    "sysid": (
        "sysid import run.csv --out run --time t --command u --cart x --pole theta",
        "sysid check run --twin rig.yaml",
        "sysid diagnose run --twin rig.yaml --out out/mine",
        "sysid open out/mine",
    ),
    "diagnose": (
        "sysid diagnose run --twin rig.yaml --out out/mine",
        "sysid diagnose monday tuesday --twin rig.yaml --hold pole_inertia_kg_m2 --out out/mine",
        "sysid diagnose recording --command-topic /rig/applied_pwm --twin rig.yaml --out out/mine",
    ),
    "fit": (
        "sysid fit run --twin rig.yaml --out refitted.yaml",
        "sysid fit run --twin rig.yaml --method thesis --max-evaluations 500 --out thesis.yaml",
    ),
    "replay": (
        "sysid replay run --twin out/mine/twin.yaml",
        "sysid replay monday tuesday --twin out/mine/twin.yaml --json",
    ),
    "compare": (
        "sysid compare run --twin rig.yaml --twin out/mine/twin.yaml",
        "sysid compare monday tuesday --twin rig.yaml --twin out/mine/twin.yaml --out runs.png",
    ),
    "effects": (
        "sysid effects",
        "sysid effects --isolability --twin rig.yaml --plan standard",
    ),
    "learn": (
        "sysid learn out/mine --out my_effects",
        "sysid learn out/mine/verdict.json --name rail_wave --out my_effects",
    ),
    "check": (
        "sysid check run --twin rig.yaml",
        "sysid check monday tuesday --twin rig.yaml --json",
    ),
    "import": (
        "sysid import run.csv --out run --time t --command u --cart x --pole theta",
        "sysid import run.csv --out run --time ms --time-unit ms --command volts --cart x_cm "
        "--length-unit cm --pole deg --angle-unit deg --pole-zero down",
        "sysid import data/*.mat --out runs --rate 200 --command u --cart x --pole theta",
    ),
    "next": (
        "sysid next run --twin rig.yaml --verdict out/mine/verdict.json --out next.yaml",
        "sysid next run --twin rig.yaml --for interval --seconds 30 --out next.yaml",
    ),
    "open": (
        "sysid open out/mine",
        "sysid open out/site",
    ),
    "prove": (
        "sysid prove --trials 20 --seed 1",
        "sysid prove --trials 5 --seed 1 --degrade --out out/degraded",
    ),
    "fleet": (
        "sysid fleet run recordings --twins rigs.yaml --store out/store",
        "sysid fleet page out/store --out out/site",
    ),
    "fleet run": (
        "sysid fleet run recordings --twins rigs.yaml --store out/store",
        "sysid fleet run s3://bucket/recordings --twins rigs.yaml --store s3://bucket/store "
        "--workers 8",
    ),
    "fleet history": ("sysid fleet history out/store --rig left",),
    "fleet compare": ("sysid fleet compare out/store --json",),
    "fleet page": ("sysid fleet page out/store --out out/site",),
    "fleet twin": ("sysid fleet twin out/store --rig left --out left.yaml",),
}
