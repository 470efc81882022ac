"""Name the schemas of files that one module writes and another reads; see docs/formats.md."""

VERDICT = "pendulum_verdict/1"  # verdict.json
SEAL = "pendulum_seal/1"  # seal.json: what an emulated rig conceals
TRIAL = "pendulum_trial/1"  # trial.json: how a sealed recording was made
DOCTOR = "rig_doctor/1"  # what `rig_doctor --json` prints
