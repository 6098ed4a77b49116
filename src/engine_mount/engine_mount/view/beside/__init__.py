"""What other mounts and policies would do now, on the same acceleration of the chassis."""
