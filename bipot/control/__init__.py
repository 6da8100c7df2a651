"""The march: how increments are tried, cut, continued and accepted."""
