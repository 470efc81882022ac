"""Every number that decides something in a diagnosis, by the question that it answers.

One line a number: value, unit, and why. The last word says where it comes from: derived (from
another number, or statistics) or measured (in a test or study). Others: chosen on emulated rigs.
"""

# Is a richer twin ahead of a simpler twin?
LEAD_STANDARD_ERRORS = 2.0  # standard errors; half of APART_STANDARD_ERRORS; derived
LEAD_MISFIT_RATIO = 1.005  # ratio; of misfits: half a per cent is worth no name
LEAD_SHARE_OF_REST = 0.5  # of power; left beyond the noise, that a richer twin must gain
RIVAL_REST_RATIO = 2.0  # ratio; of amplitudes left: a rival is outdone, an effect explains most
LIKELIHOOD_GAIN_NATS = 20.0  # nats; an effect in few windows; encoder noise is not white
LIKELIHOOD_MISFIT_RATIO = 1.01  # ratio; ... and at least this factor of misfit
MISFIT_AT_NOISE = 1.1  # noise; up to it errors are the sensors'; perfect models end at 0.9 to 1
FLOORS_AT_NOISE = 1.5  # noise floors; perfect models scatter about 1 over few held-out windows
FOLDS = 5  # folds; of cross-validation; Hastie, Tibshirani and Friedman, section 7.10
LEAD_BLOCKS = 12  # blocks; of time, over which a lead is averaged: errors nearby are alike

# Is a sign wrong, or a command late?
SIGN_MISFIT_RATIO = 1.2  # ratio; least gain of misfit by a sign that is turned
FAULT_SURE_RATIO = 2.0  # ratio; sure beforehand; 9 turned signs gain 2.5 to 112; measured

# How widely is the catalogue searched?
CANDIDATES_REFITTED = 5  # fits; what is hidden ranks fifth at worst (test_propose); measured
PROPOSAL_LEAST_NATS = 4.0  # nats; a fifth of the gain that the surest leads need; time
MOST_EFFECTS_ADDED = 5  # effects; more than concealed anywhere; bounds the time
RIVALS_REFITTED = 3  # fits; effects that are tried in the place of each name
PROBES_UNTHINNED = 8  # probes; more are thinned out by the missing force: time
PROBES_KEPT = 3  # probes; of an effect with many places or periods
LARGEST_STEP = 10.0  # typical sizes; reach of the linearised step
STEPS_A_START = 5  # iterations; from each start, before the best of several goes on: time
STARTS_REFITTED = 3  # fits; of an effect with a place, a period or a limit
SEARCH_STEP_S = 2.5e-3  # s; while sets are tried; changes runs by less than the noise: time
ALIKE_PROBES = 0.7  # correlation; probes closer than this start the same fit

# Does a name, and its size, hold on other data?
REPLICATION_PARTS = 3  # parts; of the recordings, in which a name is asked for again
REPLICATED_SHARE = 0.5  # of parts; that could show a name, and more of which must
SPREAD_BLOCKS = 6  # blocks; of time: sizes may differ between them, and sets are compared
REPEATED_DISTANCE = 0.05  # of deviations; within which a motion is the same; measured
REPEATED_APART_S = 2.0  # s; between two times of a motion, lest a window match itself
REPEATED_RATE = 0.5  # of mean squared rates; windows that move less have no error to compare
REPEATED_LEAST_PAIRS = 5  # pairs; of windows with the same motion, for a share of what is random
PREDICTED_EVERY_S = 0.05  # s; the slowest rate of samples; shorter, filters count most; measured
FORCE_SECONDS = 120.0  # s; of a recording, that a latent force's size is measured on: time
SPREAD_LEAST_BLOCKS = 3  # blocks; of two windows or more, for a spread between them
SET_DRAWS = 1000  # draws; of the weights of blocks, to weigh sets: errors of 2 %; derived
NAME_LEAST_WEIGHT = 0.75  # of weight; midway from a half, which is `perhaps`, to all; derived
SET_LEAST_WEIGHT = 0.01  # of weight; of a set that is told

# Which sets of effects help only together?
SUBSET_EFFECTS = 5  # effects; in the largest set that is tried
SUBSETS_COMPLETE = 3  # effects; up to which every set is tried: some ten thousand
SUBSETS_EXTENDED = 400  # sets; of each size, the best, to which another effect is added: time
SUBSETS_VALIDATED = 60  # sets; of each size, that are compared over blocks of time
SUBSETS_REFITTED = 3  # fits; of the sets that lead

# Could another effect stand in a name's place?
APART_STANDARD_ERRORS = 4.0  # standard errors; the wrong twin leads once in 44; derived
SURE_STANDARD_ERRORS = 5.0  # standard errors; by chance once in a million; derived
START_ERROR_GROWTH = 5.0  # median windows; a window whose start errors grow more is left out
WINDOWS_COMPARED = 40  # windows; spread evenly: more tell the same; time
DECIDING_SHARE = 0.75  # of windows; the rest is held out (the split's pattern); derived
SCREENED_STANDARD_ERRORS = 20.0  # standard errors; to first order; none beyond is refitted
SCREENING_WINDOWS = 16  # windows; for the first-order distance: time
NEAREST_REFITTED = 4  # fits; of the nearest effects; time
REFIT_ITERATIONS = 8  # iterations; of such a fit; time
SHAPES_COMPARED = 6  # shapes; of one effect, spread evenly; time
MOST_LEAD_STANDARD_ERRORS = 3.0  # standard errors; beyond which no confidence is claimed

# Do the names explain what is missing?
CHIEF_MISFIT_RATIO = 1.5  # ratio; of misfits without and with an effect: half of the power is its
RANDOM_LEAST_SHARE = 0.5  # of power; of what remains, that depends on nothing: it may be random
LEAST_EXPLAINED_SHARE = 0.5  # of power; of the errors that named effects must take away
SHAPE_TOLERANCE = 0.2**2  # of power; a law off by a fifth is still of its kind; derived
SHARED_SHAPE_TOLERANCE = 0.05**2  # of power; several laws of one variable prove less; derived
CHIEF_SHARE = 0.5  # of best gain; the rest is about the effect's own variables
SHAPE_SHARE_OF_REST = 0.25  # of power; of the rest that the shape must take away
CANCELLED_SHARE = 0.5**2  # of power; others take more than half of the size back; derived
JUDGED_SHARE = 0.1  # of larger share; effects are judged where they show

# Does a recording look like the rig of its twin at all?
UNLIKE_FLOORS = 10.0  # noise floors; of the improved twin's error: far above
UNLIKE_LEAST_FOLLOWED = 0.5  # of motion; that an improved twin of the rig follows: real rigs 0.9
LITTLE_MOST_FLOORS = 3.0  # noise floors; beyond it a twin, or "nothing is missing", is in doubt
UNNAMED_LEAST_FOLLOWED = 0.9  # of motion; the same where nothing explains the error

# When may the improved twin be used without care?
LIGHT_MOST_LOST = 0.02  # of time; in gaps and faults of the data, to take an answer as it is
LIGHT_MOST_GAPS_A_MINUTE = 10.0  # gaps a minute; ... or so many pieces

# Is an effect there everywhere, so that it is certain although something else has no name?
STEADY_SHARE = 0.5  # of size; no environment may differ by more, no part of a curve lie below
STEADY_LEAST_CURVES = 3  # curves; of moving variables, to speak of everywhere
CERTAIN_CONFIDENCE = 0.99  # probability; stated: it was surely there in every curve

# Did the pole's encoder slip? Is its scale wrong?
SLIP_SIDE_SAMPLES = 9  # samples; on each side: 0.1 s at 100 Hz, where a cubic follows
SLIP_WIDEST_GAP = 10  # samples; left out as spikes between the sides
SLIP_SEAM_S = 0.2  # s; about a gap in time or another recording, where nothing slips
SLIPS_TRIED = 4  # slips; the clearest; a rig slips rarely

# Are the reported velocities filtered?
LAG_LONGEST_S = 0.5  # s; slower filters would be useless on this rig
LAG_POWER_RATIO = 1.3  # ratio; of error power: the derivative is smoothed, not exact
LAG_WILD = 5.0  # median errors; what lies further out counts as that far

# Where does a mismatch live, and what does it depend on?
EVIDENCE_LEAST_SHARE = 0.02  # of power; of the missing power, worth a line
DEARER_SHARE = 0.05  # of power; lead of a dearer answer over a cheaper one
EVIDENCE_STANDARD_ERRORS = 4.0  # standard errors; sixty questions are asked; derived
SMALL_GAIN_STANDARD_ERRORS = 10.0  # standard errors; filters may make small gains
SMALL_GAIN = 0.25  # of noise power; a gain below it is small
EVIDENCE_MOST = 4  # questions; that explain one equation
EVIDENCE_LINES = 4  # lines; the strongest in a verdict
STRETCH_ERROR_RATIO = 2.0  # median windows; error of a stretch that is pointed out
ERROR_BLOCK_S = 0.5  # s; errors count as independent over blocks this long
BALANCE_LEAST_ROWS = 50  # samples; without so many an equation is not asked
SIEVE_NOISE_SHARE = 0.004  # of motion; noise that the smoothing filter may leave
SIEVE_WIDEST_S = 0.13  # s; to either side: finer shapes are wanted
SIEVE_REST_SHARE = 0.2  # of weight; at rest dry friction takes any value: left out
LOCALISED_SAMPLES = 120_000  # samples; twenty minutes at 100 Hz show a mismatch; time
CURVE_KNOTS = 16  # knots; resolution of a measured curve
ANGLE_KNOTS = 24  # knots; the same over a turn of the pole: 15 degrees; derived
SIDE_KNOTS = 7  # knots; on each side of zero, of a variable whose sign matters
LINE_BAND_HZ = 0.6  # Hz; to either side, of which a spectral line stands out
LINE_LEAST_PERIODS = 8.0  # periods; in the recording, of a line
LINE_LEAST_POWER = 0.02  # of highest peak; of a line
ANGLE_HARMONICS = 3  # harmonics; of a turn: eccentric encoders have one or two

# Which laws are measured where physics has no name, and how finely?
MEASURE_LAWS = True  # rule; what has no name is measured as curves
SHAPE_AS_GOOD = 1.05  # ratio; of misfits, up to which a formula does as well as its curve
SHAPE_SLACK = 0.01  # of range; error of a curve between its knots, beside its band
SHAPES_TRIED = 2  # shapes; of a curve, the most believable, that are run; time
FORMULA_REACH = 0.25  # of range; by which a formula goes on to either side
LAW_VISITED = 0.1  # of mean visits; a knot with fewer is not spoken of
LAW_KNOTS = 20  # knots; of a measured law: a period of a fifth of the travel shows
LAW_MOST_EFFECTIVE = 0.5  # of knots; effective parameters of a law: more ask for more knots
LAW_LEAST_WAY = 0.01  # of the longest way; from which on friction that slips shows
LAW_SECONDS_A_KNOT = 1.0  # s; of a law over time: slow changes, no single push
FADING_RANK = 0.95  # rank correlation; of falling power with time: it falls all along
FADING_RATIO = 2.0  # ratio; of the largest to the least power: amplitudes are told apart
LAW_MOST_KNOTS = 64  # knots; of a curve without a formula: bounds the time
LAW_LEAST_NATS = 10.0  # nats; evidence for a law by one linearised step, worth a fit
LAW_FIRST_INFLATION = 4.0  # ratio; of variances: errors within a window are correlated
LAW_MOST_INFLATION = 100.0  # ratio; beyond it the windows say nothing in common
LAW_EVIDENCE_SHARE = 0.2  # of best; evidence below which a law is not refitted; time
LAW_SHARES_PARAMETER = 0.9  # of a parameter's change of motion; a law makes it, too; measured
LAW_FIRST_GAIN = 0.005  # nats a sample; a smaller gain ends a law's first fit; time
LAW_LEAST_ERRORS = 1.0  # standard errors; of a law's gain on both halves, at least; derived
LAWS_REFITTED = 4  # fits; of the likeliest laws; time
LAWS_MEASURED = 6  # laws; a twin has a slot more, in which a further law is tried: time

# What may a fit use, and how far may it go?
INTERVAL_DEVIATIONS = 1.96  # standard deviations; to either side of a 95 % interval; derived
START_DOUBT = 1.0  # deviations; of a smoothed start, within which a fit may move it; derived
POLE_CONSTANT_RATIO = 30.0  # ratio; to the measured moment or inertia, up or down
ONE_WINDOW_SHARE = 0.99  # of weight; what one window alone fixes has no scatter to go by
WINDOW_LEAST_VALID = 0.5  # of samples; a window with fewer valid samples is left out
FLOOR_LEAD_S = 0.5  # s; of motion before a window, to smooth its start from

# What is a spike, and what a jump that stays?
SPIKE_SIDE_STEPS = 7  # steps; on either side that say what the motion was
SPIKE_SIDE_LEAST = 3  # steps; of them, so that a side is believed
SPIKE_LONGEST = 5  # samples; longer ones are motion or jumps
SPIKE_ENCODER_STEPS = 6.0  # encoder steps; the least step out of line that counts
SPIKE_DEVIATIONS = 10.0  # deviations; ... in noise of a step
SPIKE_RANGE_SHARE = 3e-4  # of range; less is of no account
SPIKE_SPREADS = 3.0  # median deviations; of the steps nearby that a step may be out of line
SPIKE_SPEED_SHARE = 0.25  # of speed; encoders also err in proportion to the speed
SPIKE_SHARED_EXCESS = 3.0  # parts; a neighbour with one part of the same excess is motion
SPIKE_TURN_SHARE = 0.125  # of a turn; a step of this size counts as a wrap
SPIKE_RETURN_SHARE = 0.25  # of step; what another step of a spike goes back, at least
SPIKE_AS_GOOD = 0.4  # of allowance; a shorter spike explains a step as well as a longer one
JUMP_RATIO = 2.0  # ratio; a step that does not return must be clearer
SMALL_SPIKE_SIDE = 5  # samples; on either side that the cubic is fitted to
SMALL_SPIKE_RATIO = 8.0  # misfits; from which samples are off the curve
SMALL_SPIKE_CLOCK = 0.1  # periods; by which the stretch may be off the clock
VELOCITY_RATIO = 3.0  # ratio; to the positions' own speed nearby

# Which samples lie on the clock?
CLOCK_ALIGNED = 0.02  # periods; a stamp this near its grid is on it
COMMAND_PAIRED = 0.4  # periods; a command this near a sample belongs to it
COMMANDS_FASTER = 1.5  # a period; commands so frequent act in parts of the period; derived
COMMANDS_EVEN = 0.75  # of steps; near their median: the commands have a clock; derived
LONGEST_FILL = 5  # samples; missing in a row that are filled; more begin a stretch
CLOCK_CLEAR = 0.25  # periods; steps this near whole periods need no following
CLOCK_FOLLOW = 0.1  # of error; by which the following clock is set at each stamp
CLOCK_BELIEVED = 0.02  # of median step; a slope further off is not a period
CLOCK_MOST_WHOLE = 0.98  # of steps or messages; on the clock, for lost messages to be counted
CLOCK_LEAST_SURE = 0.8  # of messages; whose place between the pauses of a busy computer is sure
CLOCK_LATEST = 3.0  # periods; stamps further off their clock have none
EVEN_ROUGHNESS_RATIO = 0.8  # ratio; of errors: the order of samples beats their stamps
JITTER_PERIODS = 0.1  # periods; deviation of the stamps from which it is told
MOST_RATE_HZ = 1000.0  # Hz; faster samples are left out: a rig moves at 10 Hz at most
LEAST_SAMPLES = 100  # samples; a shorter recording is unusable
LEAST_SECONDS = 2.0  # s; a shorter recording is unusable
SHORTEST_STRETCH = 10  # samples; a shorter stretch says nothing and is left out
OTHER_RUN_SHARE = 0.25  # of recording; in which another run's samples are looked for
MOST_NOT_FINITE = 0.05  # of values; NaN or infinite that a channel may hold
COMMAND_MEMORY_S = 0.2  # s; after a hole, for which delays and lags let older commands through
COMMAND_JUMP_SHARE = 0.02  # of largest command; a missing one that may be off by more
COMMAND_SPREAD = 0.1  # periods; stamps of commands this near their clock are even
SAME_RATE = 0.02  # of period; commands that answer samples come at their rate
COMMAND_CLOCK_OFF = 0.4  # periods; by which the clock of the samples may be off
SOONEST_S = 3e-4  # s; from taking to receiving at most, of the sample that takes least
COMMAND_MIDWAY = 0.3  # periods; a command this near the middle of two samples is in doubt
COMMAND_SIDE = 6  # samples; on either side that a jump is seen against; 4 to 14 do alike
COMMAND_MOVED_NATS = 4.0  # nats; by which the cart must speak for the other sample at the middle
COMMAND_FARTHER_NATS = 50.0  # nats a period; more, off the middle, and for a clock that is off
COMMAND_FAR_OFF = 2.0  # of typical power; a window so far off the twin may hold a wrong command
COMMAND_MOST_TYPICAL = 100.0  # of noise power; a twin further off in typical windows lacks physics
COMMAND_TYPICAL_AT_NOISE = 2.25  # of noise power; a typical window of a twin that lacks nothing
COMMAND_MOST_LEFT = 0.1  # of power beyond the typical; else it is no command that was wrong
COMMAND_MOST_UNEXPLAINED = 0.1  # of windows; that a busy computer spoils for good
COMMAND_TIMES_RATIO = 0.97  # ratio; of unexplained acceleration: a timing is clearly right
LONGEST_LATENCY_S = 1.0  # s; from publishing to receiving; a longer time is of two clocks
COMMAND_DIFFERS = 0.01  # of full PWM; from which on a sent command is another command
COMMAND_CROSSING_S = 0.005  # s; by which a command may be sent after it is chosen
COMMAND_MOST_DIFFER = 0.05  # of samples; that may differ where nothing is wrong
COMMAND_HOLDS_S = 10.0  # s; an older last command belongs to another clock

# Does the rig answer, stand still, or repeat itself?
STALE_SHARE = 0.25  # of stretch; from its start, and of the recording: all that is suspected
STALE_LEAST_S = 0.2  # s; shorter silences are delay, lag and dry friction
STALE_COMMAND_SHARE = 0.35  # of command; weaker commands may be lost in a dead zone
STALE_GRIP = 2.0  # ratio; friction at rest to friction in motion
STALE_COMPARABLE_S = 1.0  # s; of weak commands later on, to compare with
STALE_NATS = 50.0  # nats; by which the silence must beat an answer
ANSWER_FILTER_S = 0.3  # s; over which the balance of the cart is averaged
ANSWER_REST_SHARE = 0.5  # of weight; at rest dry friction takes any value: left out
ANSWER_LEAST_ROWS = 40  # rows; of fewer nothing is claimed
ANSWER_STANDARD_ERRORS = 10.0  # standard errors; true commands have 15, others 5 at most; measured
UNCOMMANDED_RATIO = 3.0  # ratio; of unexplained acceleration to its usual size ...
UNCOMMANDED_SHARE = 0.1  # of rows; ... in so many of those without a recorded command
UNCOMMANDED_MOST_LEFT = 0.5  # of squared acceleration; that brakes and pole leave undriven
SLIP_VELOCITY_RATIO = 10.0  # median departures; of the reading's velocity from the balance
SLIP_LEAST_M = 0.004  # m; a shorter slip is left to the fit: a stronger push looks alike
SLIP_LONGEST_S = 0.5  # s; longer departures are motion
SLIP_DRIFT_S = 2.0  # s; over which the balance may drift; a slip stands out of so much beside it
SLIP_BENDS = (0.25, 0.5, 0.75, 0.9)  # quantiles of commands; where the drive's curve may bend
SLIP_LATE_S = (0.02, 0.05, 0.1, 0.2)  # s; by which commands may act late, and any mixture of these
SLIP_STAND_S = 0.05  # s; a cart that stands so long is held: one that turns round is not
SLIP_MARGIN_S = 0.1  # s; beside a slip or a rail's end, left out with it: smoothing spreads it
RAIL_END_M = 0.002  # m; by which a reading at the end of the rail may be off
SLIP_TRIMMED = 0.05  # of rows; the worst explained: slips, too
MOST_SLIPS = 4  # slips; what happens more often is physics
LEAD_ANSWER_SHARE = 0.1  # of answer; before the command: no rig's
LEAD_ANSWER_STANDARD_ERRORS = 8.0  # standard errors; rigs show 5 at most, a filter 20; measured
LEAD_ANSWER_LEAST_ROWS = 300  # rows; 38 weights are fitted
REST_SPEED_SHARE = 0.05  # of RMS speed; of a cart that hardly moves
DRIVE_PIECES = 8  # pieces; of a drive's curve, to either side
ANSWER_TRIMMED = 0.25  # of rows; the worst explained: impacts, which no command explains
ANSWER_LATEST_S = 0.2  # s; by which an answer may come late
MOVING_DEVIATIONS = 20.0  # deviations; a joint must travel further than noise does
FROZEN_LEAST_S = 0.5  # s; a shorter standstill is not judged
FROZEN_STEP_RATIO = 5.0  # ratio; to the least that counts: a step is abrupt
FROZEN_SPEED_SHARE = 0.6  # of speed; a rig that stops has less of it in its last step
FROZEN_NEAR_STEPS = 3  # steps; before and after that say how fast the rig moved
ENCODER_NEAR = 0.05  # encoder steps; how far from a whole number a gap may be
ENCODER_SHARE = 0.95  # of gaps; that must be whole multiples
ENCODER_LEAST_GAPS = 20  # gaps; of one step that a recording must hold
ENCODER_ODD_GAPS = 5  # gaps; that may be smaller, next to spikes
LIMIT_LEAST_SAMPLES = 3  # samples; in a row at the end of a sensor, or at the limit of a command
END_LEAST_RUNS = 2  # runs; that begin or end at speed, for the end to be the sensor's
CLIPPED_SHARE = 0.02  # of recording; less is not worth a word
CLIPPED_APPROACH = 0.25  # of limit; a clipped command comes near it before; a step does not

# Can a recording be one of its rig at all?
LOWEST_RATE_HZ = 8.0  # Hz; a quarter of a second, the short horizon, has two samples
HIGHEST_RATE_HZ = 20_000.0  # Hz; twice the fastest log that is supported
USUAL_LEAST_RATE_HZ = 10.0  # Hz; least rate of a log, by which the unit of its times is guessed
RAIL_SLACK = 1.2  # ratio; of the cart's travel to the rail's length, by a wrong scale
ONE_WAY_SHARE = 0.98  # of the way of a cart; beyond the rail all one way: no cart does
RAIL_CERTAIN = 3.0  # ratio; beyond a wrong constant, if the motion speaks for another unit
RAIL_IMPOSSIBLE = 10.0  # ratio; ... and whatever the motion says
COMMAND_SLACK = 1.2  # ratio; of the largest command to the twin's limit
COMMAND_CERTAIN = 10.0  # ratio; beyond a wrong limit, if the drive speaks for another unit
UNIT_FACTOR = 3.0  # ratio; of a measured unit to a named unit: units are 10 apart; derived
GAIN_FACTOR = 4.0  # ratio; a drive further off is worth a look: constants err by a factor of two
FREQUENCY_FACTOR = 2.5  # ratio; a pole further off is worth a look, and convicts no unit
GRAVITY_FACTOR = 1.5  # ratio; of gravity as measured: scales and clocks err less; measured
GRAVITY_CERTAIN = 3.0  # ratio; no sensor's scale and no clock is so far off: other units
FREQUENCY_DOUBT = 1.5  # ratio; of frequencies: a pole half as long, or twice, is another rig's
ONE_RIG_FACTOR = 1.1  # ratio; of a pole's frequencies in two recordings: real rigs show 1.04
ONE_RIG_CERTAIN = 1.25  # ratio; ... another pole, or another unit
BALANCE_SURE = 0.9  # of power; of the pole's acceleration, so that its equation holds
BALANCE_UNSURE = 0.5  # of power; of it, below which another unit or column may be meant
DEGREES_STEP_CHANGE = 1.0  # degrees; from step to step of the fastest pole at 100 Hz
BALANCE_FOREIGN = 0.2  # of power; of a wide swing, below which it is no pole's: rigs show 0.9
BALANCE_TRIMMED = 0.02  # of samples; the worst explained: jumps that cleaning has left
BALANCE_CORRELATED_SAMPLES = 20.0  # samples; smoothing spreads an error over so many
ZERO_DOUBT_RAD = 1.0  # rad; a pole that hangs this near to 0 has another zero
ZERO_CERTAIN_RAD = 0.4  # rad; ... and surely; hanging at half a turn, read as 0.5 rad, is not
WIDE_SWING_RAD = 1.0  # rad; poles held upright by a controller move less
REST_SECONDS = 1.0  # s; a pole does not stand upright so long by itself
REST_RAD = 0.1  # rad; about upright
REST_RAD_S = 0.05  # rad/s; of a pole at rest

# Does a recording contradict a constant as given?
CONTRADICTED_DEVIATIONS = 3.0  # deviations; of belief and estimate together; derived
MOVING_MASS_RATIO = 1.5  # ratio; by which a moving mass is wrong, beyond a wrong scale
GIVEN_DEVIATION = 0.01  # of value; of constants as an earlier diagnosis gives them; measured
ALIKE_RATIO = 1.25  # ratio; between two factors that count as one

# Does what is missing stand in a few stretches?
EVENT_FLOORS = 5.0  # ratio; of a window's error to the median's, or to the floor
EVENT_REST_FLOORS = 3.0  # floors; of the median window: the events have spoiled the fit little
EVENT_MOST_SHARE = 0.25  # of windows; what is missing in more of them is a law
MOST_EVENTS = 8  # stretches; what happens more often is a law

# What is worth telling, and worth an experiment?
LEAST_MASKED_CHANGE = 0.05  # of value; change of a constant that is worth a sentence
CHANGED_VALUES_LISTED = 3  # values; in the sentence of a verdict without a name
WIDE_INTERVAL = 0.1  # of value; half widths beyond it are worth an experiment
MOST_PLANNED_FOR = 3  # ties, or intervals; asked at once, the closest or the widest first
INTERVAL_SHARE = 0.5  # of width; that an experiment is to leave
RAIL_SHARE = 0.75  # of rail; each way: the rig is not the twin
PLAN_FASTEST_M_S = 4.0  # m/s; well below what a plan is stopped at
PLAN_FASTEST_RAD_S = 30.0  # rad/s; well below what a plan is stopped at
PHASES_REFINED = 12  # phases; candidates that are asked again after the first phase

# Which rules may rescue or doubt what a search has found?
SETTLE_DOUBTFUL_SIGNS = True  # on or off; a doubtful sign is decided by what searches end at
ASK_POLE_ALONE = True  # on or off; search the pole by itself, its axis moved as recorded
DOUBT_BY_UNNAMED = True  # on or off; intervals hold what effects without a name may have done
BEGIN_WITH_SUBSETS = True  # on or off; ... and begins with sets that help only together
CONFIRM_LONG_HORIZON = True  # on or off; what long windows add must show over short ones
ACCEPT_LIKELIHOOD = True  # on or off; an effect in a few windows may win by likelihood
ACCEPT_STEADY = True  # on or off; a sure lead, however small, of an effect that is steady
CHECK_SHAPES = True  # on or off; doubt a name whose law has another shape
CHECK_SLIGHT = True  # on or off; doubt names that explain little over whole windows

# Has a rig changed between its recordings, and is a rig unlike the others?
FALSE_CHANGE_SHARE = 0.01  # of quiet histories; that may show a change anywhere; derived
CONFIRMED_SHARE = 0.01  # of shuffled orders; that may show as much as a change that is believed
LEAST_HISTORY = 8  # recordings; a shorter history of a size shows no change
LEAST_SEGMENT = 3  # recordings; between changes: two that err together are no change
HISTORY_OUTLIER = 3.0  # deviations; from its neighbours' median, beyond which a value is drawn in
FALSE_UNLIKE_SHARE = 0.05  # of comparisons; in which a rig may be called unlike by chance; derived
LEAST_RIGS = 4  # rigs; fewer do not say what is usual
SHARED_BY_RIGS = 0.5  # of rigs; an effect of more of them belongs into the nominal twin
NAMED_OFTEN = 0.5  # of recordings; an effect named in more of them is the rig's
