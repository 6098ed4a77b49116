"""What the electronics and those who answer them have agreed on, as `mount.dbc` says."""

SAMPLE_RATE = 1000.0  # Hz, chosen: how often the electronics measure and are answered
SAMPLE_TIME = 1.0 / SAMPLE_RATE  # s
SAMPLE_TIME_NS = round(1e9 * SAMPLE_TIME)

HIGHEST_CURRENT = 3.0  # A, section 3.2: of the coil, wherever a current passes
SETPOINT_TIMEOUT = 0.020  # s, chosen: greatest age of the sample that a current answers; then 0 A
