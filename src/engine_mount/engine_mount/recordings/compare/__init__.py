"""Two recordings, sample by sample, in numbers and words; references."""
