"""The page about the result of a fleet: made of its table, without the program that made that."""
