"""Surfaces of rigid tools from straights and rounds, and of several surfaces."""

from bipot.profiles.profile import Profile
from bipot.profiles.shapes import flat_punch, wedge
from bipot.profiles.union import Union

__all__ = ["Profile", "Union", "flat_punch", "wedge"]
