"""Roads: height over distance from files of others, their class, and drives over them."""
