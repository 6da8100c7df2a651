"""Finite elements: reference shapes, kinematics of one increment, assembly."""
