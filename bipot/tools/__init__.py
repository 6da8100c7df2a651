"""Rigid tools: surfaces, poses, driving forces and moments, and how candidates meet and slip along them."""
