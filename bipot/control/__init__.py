"""The march: increments tried, cut, carried on and accepted."""
