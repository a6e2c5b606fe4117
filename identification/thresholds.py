"""The numbers that decide what is said of a log: adequate, identified or null, an effect, drift.

Each is a value to which one statistic is compared; numbers that only steer a search stand where it
is. `benchmarks/ablation.py` shows what each changes on the blind benchmark, off, halved or doubled;
`benchmarks/blind.py` (seeds below 3100), `nine_parameters.py` (below 600) and `drift.py` (below
9000) served to choose them. `tests/identification/test_thresholds.py` holds for each what it
decides on either side. Where one statement had stood as several numbers, as 0.4 of a sample beside
0.3 of a square, they were made one if no verdict of the verdict table changed by it. A misfit is a
mean square in units of the sensors' noise.
"""

# Shares: of what was missing before, of friction, of a square error, of a sample, of a turn, of the
# samples of a log (blind.py: single, removed; chapters.py; real.py).
EARNS = 0.8  # left at most by whatever joins a model: an effect, gravity, a lag, another level
HALF = 0.5  # left at most by what explains most; of a turn, in which neighbouring orders differ;
# of a value, the half width of its interval up to which it is identified; of a sample, to either
# side of its row, in which a measured force acts
FAR_LESS = 0.3  # left at most by another law of the same: two masses for one, a bristle; of a
# sample, from which a motor's command and its motion are not of one instant
OF_ACCOUNT = 0.1  # less of what is missing, or of all, is of no account
NEARLY_ALL = 1.0 - OF_ACCOUNT  # chance with which a test alarms that is to find a change
MATERIAL = 0.01  # of the Coulomb level, of a value, of an equation's square: the least reported
AS_GOOD_AS_NONE = 1e-3  # of the force, the motion

# What is left, as a mean square in units of the noise: of a free run in windows, of whole runs, of
# an equation's rows, of the test logs (blind.py: clean, single; nine_parameters.py; drift.py).
COMPLETE = 1.0 + OF_ACCOUNT  # nothing is missing (1: what is left is noise)
ADEQUATE = 1.0 + HALF  # hardly more than noise: followed, adequate, predicted
ASTRAY = 3.0  # something is missing, or a measured force's noise has drifted as far
CHANCE_WINDOWS = 0.15  # of a free motor's windows, that chance may have spoilt

# How sure: chances, deviations, twice a log-likelihood (blind.py: clean; real.py).
CHANCE_LEVEL = 0.01  # chance up to which the largest gain of the library is significant
BEYOND_CHANCE = 5.0  # deviations from 0 of one size of many tried; squared, of a criterion
HOPELESS = BEYOND_CHANCE**2  # misfit far beyond noise: no run of the body's own, of any model
GATE_MARGIN = 3.0  # times the information's deviation, by which a parameter is called identifiable
PENALTY = 10.0  # criterion that each parameter of a structure has to gain (about log n: BIC)
FAULT_FROM = 9.0  # times the noise, by which a sample stands out that no body can have made

# One value beside another, as a factor (blind.py: removed; real.py).
WORSE = 1.05  # from which an error is clearly the larger, a frequency another
TWICE = 2.0  # of the usual error on other logs; of what is left, inertia that shows; of the gain of
# columns at one place, that a search over shapes finds by chance
FOURFOLD = 4.0  # the slow strokes the quick ones, to identify friction of speed alone; of power the
# noise the signal, in a response that is relied on
COHERENCE_SURE = FOURFOLD / (1.0 + FOURFOLD)  # coherence of that

# How many, how much a log has to show (nine_parameters.py, chapters.py, drives.py, drift.py).
EVENTS_NEEDED = 3  # of a kind: breakaways, crossings, averages of a spectrum, points at a peak
MANY_OF_A_KIND = 8  # windows of sliding in each direction; samples of one value, that are frozen
SEEN = 0.08  # of a Coulomb level, beyond the margin that does not matter: the change that is seen
