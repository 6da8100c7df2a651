"""Checks of an increment's answer beside its certificate, and diagnosis where no answer was found."""
