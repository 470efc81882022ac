"""Where a mismatch lives and what shape it has, read off the balance of forces and torques.

`localise` is the stage: place, evidence, stretches. `shape_check` asks the same questions of what
a fit leaves. Both go through `inspection`: each equation (`balance`, seen through a `sieve`, on
pieces of a long recording: `thinning`) is asked `questions` about variables and time,
`past_questions`, `sensor_questions` and `waves`, all of them columns of one `table`; `explain`
chooses those that explain it, and `measured_curves` draws them.
"""
