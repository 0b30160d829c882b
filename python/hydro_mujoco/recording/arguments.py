"""Command-line values that the generators share, checked while they are parsed."""

import argparse


def count(text: str) -> int:
    """A positive integer."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is not a positive number")
    return value


def seed(text: str) -> int:
    """An integer that is not negative."""
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{value} is negative; a seed is 0 or more")
    return value


def splits(text: str) -> tuple[float, float, float]:
    """Shares of train, val, test."""
    try:
        shares = tuple(float(part) for part in text.split(","))
    except ValueError:
        shares = ()
    if len(shares) != 3 or not all(0 <= share <= 1 for share in shares) or abs(sum(shares) - 1) > 1e-9:
        raise argparse.ArgumentTypeError(
            f"`{text}`: expected three shares train,val,test that sum to 1, such as 0.8,0.1,0.1"
        )
    return shares
