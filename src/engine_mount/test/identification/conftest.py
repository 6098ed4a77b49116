"""What the tests share: joints with known sliding, sticking, play and zero of the force (`joint.py`)."""

import sys
from pathlib import Path

# The tests are imported one by one (importmode importlib); what they share is found by this path.
sys.path.insert(0, str(Path(__file__).parent))
