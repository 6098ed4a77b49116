"""A recording made of others: cut, merged, recovered."""
