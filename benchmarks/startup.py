"""How long the first word takes: `workbench --help` and `import workbench` over an empty Python.

    python benchmarks/startup.py [--times 15]

Processor time of each, the least of so many runs in turn, and its ratio to Python that does
nothing. Exit status 1 where one takes 0.1 s or more beyond that.
"""

import argparse
import subprocess
import sys
from resource import RUSAGE_CHILDREN, getrusage

ASKED = 0.1  # s beyond an empty Python
WHAT = {
    "empty Python": ("-c", "pass"),
    "import workbench": ("-c", "import workbench"),
    "workbench --help": ("-m", "workbench", "--help"),
}


def processor_seconds(arguments: tuple[str, ...]) -> float:
    """Processor time of one process [s]."""
    before = getrusage(RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
    after = getrusage(RUSAGE_CHILDREN)
    return (after.ru_utime - before.ru_utime) + (after.ru_stime - before.ru_stime)


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=15)
    times = parser.parse_args().times
    runs = [{name: processor_seconds(how) for name, how in WHAT.items()} for _ in range(times)]
    least = {name: min(run[name] for run in runs) for name in WHAT}
    empty = least["empty Python"]
    for name, seconds in least.items():
        print(f"{name:18} {seconds:.3f} s, {seconds / empty:.1f} times, {seconds - empty:+.3f} s")
    return int(max(least.values()) - empty >= ASKED)


if __name__ == "__main__":
    sys.exit(main())
