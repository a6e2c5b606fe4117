"""The table of verdicts: what changed, or the committed answers rewritten.

python tools/verdicts.py                    # what changed, and what every entry says and takes
python tools/verdicts.py --only cogging     # entries whose names hold this
python tools/verdicts.py --write            # the answers are changed on purpose
"""

import argparse
import sys

import pytest


def main() -> int:
    """Runs the tests of the table with the options that they know."""
    parser = argparse.ArgumentParser(description="The table of verdicts.")
    parser.add_argument("--write", action="store_true", help="rewrite the committed answers")
    parser.add_argument("--only", default="", help="an expression of pytest's -k")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    arguments = ["tests/verdicts/test_verdicts.py", "-m", "verdicts", "-q", "--verdicts-all"]
    if given.workers > 1:
        arguments += ["-n", str(given.workers), "--dist", "worksteal"]
    if given.only:
        arguments += ["-k", given.only]
    if given.write:
        arguments += ["--verdicts-write"]
    return int(pytest.main(arguments))


if __name__ == "__main__":
    sys.exit(main())
