"""The convex programs of an increment: stated in cvxpy, posed to Clarabel directly, or solved by Newton's method."""
