"""Where what the tests share is found."""

import sys
from pathlib import Path

# The tests are imported one by one (importmode importlib); what they share is found by this path.
sys.path.insert(0, str(Path(__file__).parent))
