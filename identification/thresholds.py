"""The numbers that decide what is said of a log: adequate, identified or null, an effect, drift.

Each is a value to which one statistic is compared; numbers that only steer a search stand where it
is. `benchmarks/ablation.py` shows what each changes on the blind benchmark, off, halved or doubled;
`benchmarks/blind.py` (seeds below 3100), `nine_parameters.py` (below 600) and `drift.py` (below
9000) served to choose them. `tests/identification/test_thresholds.py` holds for each what it
decides on either side. A misfit is a mean square in units of the sensors' noise.
"""

# What is left, as a mean square in units of the noise: of a free run in windows, of whole runs, of
# an equation's rows, of the test logs (blind.py: clean, single; nine_parameters.py; drift.py).
COMPLETE = 1.1  # nothing is missing (1: what is left is noise)
ADEQUATE = 1.5  # hardly more than noise: followed, adequate, predicted
ASTRAY = 3.0  # something is missing, or a measured force's noise has drifted as far
NEARLY_FOLLOWED = 8.0  # not followed, but near
HOPELESS = 25.0  # far more than noise: no run of the body's own, a machine that no model follows
CHANCE_WINDOWS = 0.15  # of a free motor's windows, that chance may have spoilt
INERT = 2.0  # times what is left of the force, below which inertia does not show

# How sure: chances, deviations, twice a log-likelihood (blind.py: clean; real.py).
CHANCE_LEVEL = 0.01  # chance up to which the largest gain of the library is significant
BEYOND_CHANCE = 5.0  # deviations from 0 of one size of many tried; squared, of a criterion
PENALTY = 10.0  # criterion that each parameter of a structure has to gain (about log n: BIC)
SEARCHED = 2.0  # times the gain of columns at one place, that a search over shapes finds by chance

# How much: shares of what was missing before, beyond noise (blind.py: single, removed; real.py).
EARNS = 0.8  # left at most by whatever joins a model: an effect, gravity, a lag, another level
HALF_LEFT = 0.5  # left at most by what explains most of it
FAR_LESS = 0.3  # left at most by another law of the same: two masses for one, a bristle
ALONE = 0.15  # left at most by what needs no contest with rivals
SHARE_LEFT = 0.01  # left where effects are there without a doubt
ROUGH_LEFT = 0.05  # the same, on machines that no model follows down to the noise

# How large, beside what matters to the machine (blind.py; chapters.py; real.py).
MATERIAL = 0.01  # of the Coulomb level, a value, an equation's square: the least reported
OF_ACCOUNT = 0.1  # of a square error, of the force: what explains, or hides, less is not reported

# One error beside another, as a factor (blind.py: removed; real.py).
AS_WELL = 1.02  # up to which one is as good as the other
WORSE = 1.05  # from which it is clearly worse: than the equation of motion, than the plain model
CARRIED = 2.0  # of test logs over training logs, up to which a model carries over

# What a test of a new log must be able to see, or it is inconclusive (drift.py: coarse).
SEEN = 0.03  # of a Coulomb level, beyond the margin that does not matter: the change that it sees
CHANCE_TO_SEE = 0.9  # chance with which it would have alarmed

# What acts beside the applied force and is taken out first (real.py: rigs and cases).
LAG_FROM = 0.4  # samples, from which motion and force are not of one instant
ORDERS_FROM = 0.5  # turns of motion, in which neighbouring orders differ
OTHER_WAY = 0.02  # of the windows of sliding, up to which those of a direction are noise
BEYOND_FRICTION = 0.05  # of the larger Coulomb level, by which the other has to be negative

# What is seen over frequency: responses, modes, a load behind its motor (response.py, notch.py).
COHERENCE_SEEN = 0.5  # coherence from which a response is drawn
COHERENCE_SURE = 0.8  # coherence from which it is relied on
APART_SHARE = 0.01  # of an input's power, that no other makes; less is lost in what windows leak
STANDS_OUT = 0.4  # of the response, that a resonance adds or an anti-resonance takes away

# What a log identifies of a parameter, and what drives it (nine_parameters.py, chapters.py,
# drives.py).
SLIDES_NEEDED = 8  # windows of sliding in each direction, for an axis test
EVENTS_NEEDED = 3  # of a kind: breakaways, crossings, averages of a spectrum, points at a peak
NOTHING_OF = 1e-4  # of the log's force (speed), a friction (a band) that is as good as 0
WIDEST_SD = 0.255  # deviation over the value, beyond which its interval is wider than the value
SPEEDS_APART = 4.0  # times the slow strokes the quick ones, to identify friction of speed alone
GATE_MARGIN = 3.0  # times the information's deviation, by which a parameter is called identifiable
JITTER_FROM = 0.5  # times the position's noise at rest, that of a jittering clock in fast motion
ACTUATOR_SHARE = 0.02  # of the force, that an actuator leaves which is no linear one

# Samples excluded from a log (sound_logs.py, bad_samples.py below seed 100); times the noise.
FAULT_FROM = 9.0  # step of a position, or distance of 1 to 3 samples, that no body can have made
RUN_FAULT_FROM = 6.0  # the same in what a run that follows the log leaves, in its own deviations
FROZEN_RUN = 8  # samples of one value in a signal that repeats none elsewhere
PLACES_EXCLUDED = 5  # of a log, by the word of a run that follows it but for these
SHARE_EXCLUDED = 1e-3  # of its samples, the same
