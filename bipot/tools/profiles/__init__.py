"""Surfaces of rigid tools made of straights and rounds, and unions of several surfaces."""

from bipot.tools.profiles.profile import Profile, flat_punch, wedge
from bipot.tools.profiles.union import Union

__all__ = ["Profile", "Union", "flat_punch", "wedge"]
