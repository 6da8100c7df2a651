"""What is asked of the answer of an increment beside its certificate, and what is said where there is none."""
