"""Rounding that makes numbers equal on processors that differ in the last digit."""


def in_digits(value: float) -> float:
    """The number rounded to 12 significant decimal digits."""
    return float(f"{value:.12g}") + 0.0  # no -0.0
