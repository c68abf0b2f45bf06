"""Runs the tests of a file. If none failed and some were skipped, prints the skipped tests with reasons and exits
with 77, which ctest counts as skipped."""
import os
import sys
import unittest

SKIPPED = 77
IS_FULL = "OBLIQUE_TEST_ALL" in os.environ


def full(test):
    """Decorates a test that only `deploy/test --all` runs."""
    return test if IS_FULL else None


def main(**more):
    ran = unittest.main(exit=False, **more).result
    for test, why in ran.skipped:
        print(f"SKIPPED: {test}: {why}")
    if not ran.wasSuccessful():
        sys.exit(1)
    sys.exit(SKIPPED if ran.skipped else 0)
