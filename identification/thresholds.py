"""The numbers that decide what is said of a log: adequate, identified or null, an effect, drift.

Each is a value to which one statistic is compared; numbers that only steer a search stand where it
is. `benchmarks/ablation.py` shows what each changes on the blind benchmark, off, halved or doubled;
`benchmarks/blind.py` (seeds below 3100), `nine_parameters.py` (below 600) and `drift.py` (below
9000) served to choose them. `tests/identification/test_thresholds.py` holds for each what it
decides on either side. A misfit is a mean square in units of the sensors' noise.
"""

# Misfit of a free run in windows, chi-square of whole runs: mean squares in units of the noise
# (clean and single runs of blind.py, nine_parameters.py; LIKE: drift.py).
COMPLETE = 1.1  # nothing is missing (1: what is left is noise)
ADEQUATE = 1.5  # hardly more than noise: a fit is adequate, a structure found in the run is taken
FOLLOWED = 2.0  # a stop lost here or there: the structure still follows the log
ASTRAY = 3.0  # something is missing, or a measured force's noise has drifted as far
NEARLY_FOLLOWED = 8.0  # not followed, but near
CHANCE_WINDOWS = 0.15  # of a free motor's windows, that chance may have spoilt
FORGIVEN_FROM = 4  # windows, of which chance may have spoilt one
NO_RUN = (
    50.0  # no run of the body's own motion (of a drifted log: times what the model's own leave)
)
LIKE = 4.0  # times the misfit of the active model, where that leaves more than noise

# What the equations' rows leave, in units of their noise (blind.py, chapters.py).
MUCH = 2.0  # root mean square: something is missing from an equation
MUCH_IS_LEFT = 25.0  # mean square: far more than noise is left
INERT = 2.0  # times what is left, below which inertia does not show

# Which effects the equations name (blind.py: clean, single; chapters.py).
PENALTY = 5.0  # criterion (twice a log-likelihood) that each parameter has to gain
CALLED = 10.0  # the same, of an optional parameter
CHANCE_LEVEL = 0.01  # chance up to which the largest gain of the library is significant
SEARCHED = 2.0  # times the gain of columns at one place, that a search over shapes finds by chance
MATERIAL = 0.002  # of the Coulomb level (of the spread of dF/dt): the smallest effect spoken of
LEAST_SHARE = 0.25  # of what is missing, that an effect explains; less is another's shadow
MOSTLY_EXPLAINED = 0.55  # the same, where much is left in the end
CARRIES = 0.95  # of the error on stretches left out, that an effect leaves at most there
ELASTIC = 0.3  # of the motion seen at rest, that a bristle leaves at most
CHANCE_IN_GAIN = 10.0  # criterion by which two effects that explain equally may differ

# Which effects the free run confirms: shares of a misfit beyond 1 (blind.py: single, removed).
HELPS = 0.75  # left at most by effects that leave more than noise, or they are useless
EARNS = 0.8  # left at most by one effect more
HALF_OF_EXCESS = 0.5  # left at most by an effect that only the run shows
ALONE = 0.15  # of any rival's, left by one that is taken too where that is near
UNCONTESTED = 0.1  # left by effects that need no contest
NEEDLESS = 1.02  # times the misfit, without an effect that is not needed
DOES_NOTHING = 1.002  # the same, of the plant as it is
IDLE = 1.0001  # the same, of a single effect that the equations call for, whose size is none

# What is left, and whether it carries over (blind.py: removed; outside.py --strange; chapters.py).
SHARE_LEFT = 0.01  # of the square that was missing, left where effects are there without a doubt
ROUGH_LEFT = 0.05  # the same, on machines that no model follows down to the noise
IMPOSED_LEFT = 0.3  # the same, with prescribed motion
# (the next three by what they mean; no bench has chosen them yet)
SHOWN_FROM = 2.0  # times the sensors' square, that an error on the test logs is to be spoken of
MAIN_EFFECTS_LEAVE = 0.5  # share left at most of what was missing there, by effects reported first
OTHER_LAW = 0.05  # the same, that depends on an effect's own signals: the law is another one
HIDES = 0.1  # of the force, left where it is more than friction too: nothing can be said of either
STRUCTURED = 0.3  # square in noise units, from which what is left is structure
CARRIED = 2.0  # times the training logs' force error, that the test logs' may be
LEAST_DEPENDENCE = 0.08  # share of the rest that a signal explains, or it depends on none
MOST_PLACES = 3  # effects of place in one machine, which rather are pieces of another law

WORSE_PREDICTION = 1.1  # times the plain model's error of the held-out position, with effects

# What differs between the logs: drift (blind.py: drift; chapters.py).
DRIFT_GAIN = 30.0  # chi-square that a parameter freed gains
DRIFT_SHARE = 0.1  # of the test logs' square error, that it takes away
DRIFT_LEAST = 0.01  # of its value, that it changes
FOLLOWS_AS_WELL = 1.5  # times the usual error of whole runs, up to which one is followed as usual
LEVELS_LEAVE = 0.8  # of a run's error, left at most by Coulomb levels fitted before it

# What a test of a new log must be able to see, or it is inconclusive (drift.py: coarse).
SEEN = 0.03  # of a Coulomb level, beyond the margin that does not matter: the change that it sees
CHANCE_TO_SEE = 0.9  # chance with which it would have alarmed

# What the equation of motion's own least squares are to a fit (real.py).
WORSE_THAN_EQUATION = 1.05  # times what they leave of the force unseen, that a fit may leave
CONTRADICTS_EQUATION = 1.3  # the same, from which a run's nearness to the log does not matter
BEYOND_EQUATION = 0.01  # of the Coulomb level, left beyond it by a run followed to the noise
RUN_ASTRAY = 0.02  # of the travel, that a run is off by (rms), from which the equation decides
MOST_UNEXPLAINED = 0.5  # of the force that a model leaves, beyond which none of its numbers holds

# What acts beside the applied force and is taken out first (real.py: rigs and cases).
LAG_FROM = 0.4  # samples, from which motion and force are not of one instant
LAG_LEAVES = 0.5  # of the equation's square, left at most by a lag that no run shows
SURROUNDINGS_LEAVE = 0.8  # of the equation's square, left at most by a lag, or by gravity
SURE_OF_SURROUNDINGS = 4.0  # deviations from 0, of either
ORDERS_LEAVE = 0.5  # of the same, left at most by all orders of a turn that repeat with it
SURE_OF_ORDER = 5.0  # deviations from 0, of each: a hundred are tried
ORDERS_FROM = 0.5  # turns of motion, in which neighbouring orders differ
TWO_MASSES_LEAVE = 0.3  # of the square that one body leaves, left at most by two
RESONANCE_APART = 1.02  # times the anti-resonance, from which a resonance shows a load
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
SMALLEST_LEVEL = 1e-3  # of what is left of the force, a Coulomb level of which it is no share
WIDEST_SD = 0.255  # deviation over the value, beyond which its interval is wider than the value
HARDLY_MORE = 1.02  # times the least force left unseen, that fewer terms of friction may leave
SPEEDS_APART = 4.0  # times the slow strokes the quick ones, to identify friction of speed alone
GATE_MARGIN = 3.0  # times the information's deviation, by which a parameter is called identifiable
LINEAR_ACTUATOR = 0.97  # share of dF/dt that a linear actuator leaves at most
SURE_OF_RANDOM_WALK = 20.0  # criterion that a walk of the force off its logged command has to gain
SURE_OF_SHARE = 6.0  # deviations from 0 of a command's change between the samples of a slow log
SHARE_GAINS = 0.01  # of the square that the equation leaves, what that change has to explain
SHARE_BEYOND = 2.0  # deviations by which that change may be larger than of any faster loop
JITTER_FROM = 0.5  # times the position's noise at rest, that of a jittering clock in fast motion
ACTUATOR_MISFIT = 3.0  # times the sensors' noise, that one leaves of the force where it is none,
ACTUATOR_SHARE = 0.02  # and share of the force, that it has to leave as well

# Samples excluded from a log (sound_logs.py, bad_samples.py below seed 100); times the noise.
FAULT_FROM = 9.0  # step of a position, or distance of 1 to 3 samples, that no body can have made
RUN_FAULT_FROM = 6.0  # the same in what a run that follows the log leaves, in its own deviations
REPLACED_GAINS = 15.0  # cost that a run gains without one sample of its drive, that is bad
RESIDUAL_DRIFTS = 4.0  # deviations of its sums beyond noise, from which what a run leaves walks
FROZEN_RUN = 8  # samples of one value in a signal that repeats none elsewhere
SHARE_EXCLUDED = 1e-3  # of a log, by the word of a run that follows it but for these samples
