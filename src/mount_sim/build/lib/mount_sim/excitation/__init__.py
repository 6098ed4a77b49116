"""What shakes the plant: scenarios, roads, recorded accelerations."""
