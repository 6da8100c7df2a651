"""Tools: surfaces, where they are, how they are driven, how a point meets and slips along them."""
