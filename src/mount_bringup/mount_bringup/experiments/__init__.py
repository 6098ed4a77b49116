"""The paper's experiments: one file for each, behind the contract of `contract`, listed in `registry`."""
