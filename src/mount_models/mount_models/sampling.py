"""How often the electronics measure, which is also how often they are answered."""

SAMPLE_RATE = 1000.0  # Hz, chosen
SAMPLE_TIME = 1.0 / SAMPLE_RATE  # s
