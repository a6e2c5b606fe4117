"""The page: 10 000 machines, 50 readers at once, and the first plot of a million samples.

    python benchmarks/page.py                       # SQLite
    python benchmarks/page.py --postgresql          # a server of the tests' own
    python benchmarks/page.py --machines 1000 --readers 10 --samples 100000

Times are medians, in one run on one machine; what else runs there is in them. The readers are
threads of this process on the same processors as the servers. The plot is timed in Chromium, from
the click on "Look at it" until every chart of the log has ink; without Chromium its part is left
out.
"""

import argparse
import http.client
import os
import statistics
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np

from benchmarks.page_fleet import fill
from tests.workbench.page.browser import CHROMIUM, DRIVER, Person
from tests.workbench.page.served import serving
from tests.workbench.registry.postgres import new_server
from workbench.registry.access import Access
from workbench.registry.overview import FLEET_ORDERS, FleetAsked, fleet_page
from workbench.registry.store import Registry

QUERIES = 15
WARMING = 3.0  # s
WARMING_PLOTS = 2  # until every server has its helper
LAST_LOGS_READ = 30_000  # samples
PATHS = ("/", "/?order=moved&down=1", "/?state=drifting", "/?page=150", "/?text=99",
         "/machine/axis-00042")  # fmt: skip


def main() -> None:
    """Print each figure."""
    asked = argparse.ArgumentParser(description=(__doc__ or "page").splitlines()[0])
    asked.add_argument("--machines", type=int, default=10_000)
    asked.add_argument("--readers", type=int, default=50)
    asked.add_argument("--samples", type=int, default=1_000_000)
    asked.add_argument("--servers", type=int, default=2)
    asked.add_argument("--seconds", type=float, default=15.0, help="that the readers read")
    asked.add_argument("--postgresql", action="store_true")
    given = asked.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} before")
    with (
        tempfile.TemporaryDirectory(prefix="page-") as name,
        _where(given.postgresql, name) as where,
    ):
        root = Path(name) / "machines"
        fill(where, given.machines)
        _queries(where, given.machines)
        with serving(where, root, "--servers", str(given.servers)) as served:
            for pause in (0.0, 1.0):
                _readers(served.address, given.readers, pause, given.seconds)
            _plots(served.address, where, Path(name), given.samples)


@contextmanager
def _where(postgresql: bool, folder: str) -> Iterator[str]:
    if not postgresql:
        yield f"{folder}/r.db"
        return
    server = new_server()
    try:
        yield server.database()
    finally:
        server.remove()


def _queries(where: str, count: int) -> None:
    """What the database alone takes for a page of the fleet."""
    since = datetime.now(UTC) - timedelta(days=7)
    with Registry(where) as registry:
        for order in FLEET_ORDERS:
            asked = FleetAsked(since, order=order, down=True, page=max(count // 100, 1))
            taken = []
            for _ in range(QUERIES):
                begun = time.perf_counter()
                fleet_page(registry.database, asked)
                taken.append(time.perf_counter() - begun)
            print(f"fleet of {count} by {order}: query {1e3 * statistics.median(taken):.1f} ms")


def _readers(address: str, readers: int, pause: float, seconds: float) -> None:
    """Median and 95th percentile of what readers wait, each asking again after `pause` s."""
    split, waits = urlsplit(address), list[float]()
    end = time.monotonic() + WARMING + seconds
    counts_from = time.monotonic() + WARMING
    lock = threading.Lock()

    def read(number: int) -> None:
        link = http.client.HTTPConnection(split.hostname or "", split.port)
        rng = np.random.default_rng(number)
        time.sleep(float(rng.uniform(0.0, pause or 0.1)))
        while time.monotonic() < end:
            begun = time.perf_counter()
            link.request("GET", PATHS[int(rng.integers(len(PATHS)))])
            answer = link.getresponse()
            answer.read()
            took = time.perf_counter() - begun
            assert answer.status == 200, answer.status
            if time.monotonic() > counts_from:
                with lock:
                    waits.append(took)
            time.sleep(pause)
        link.close()

    threads = [threading.Thread(target=read, args=(k,)) for k in range(readers)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    how = f"again after {pause:g} s" if pause else "again at once"
    median, late = statistics.median(waits), float(np.quantile(waits, 0.95))
    rate = len(waits) / seconds
    print(f"{readers} readers, {how}: median {1e3 * median:.0f} ms, 95 % {1e3 * late:.0f} ms,"
          f" {rate:.0f} pages a second")  # fmt: skip


def _plots(address: str, where: str, folder: Path, samples: int) -> None:
    """The first plot of a long log as a person waits for it, in both usual formats."""
    if CHROMIUM is None or DRIVER is None:
        print("first plot: not timed, no Chromium")
        return
    with Registry(where) as registry:
        token = Access(registry.database).add("bench", "change", by="b", now=datetime.now(UTC))
    person = Person(address)
    try:
        person.go("/sign-in")
        person.type("#token", token)
        person.find("form.narrow button").click()
        person.reads("bench (change)")
        for path in _logs(folder, samples):
            taken = [_plot(person, path) for _ in range(WARMING_PLOTS + 3)][WARMING_PLOTS:]
            size = path.stat().st_size / 1e6
            said = f"{samples} samples, {path.suffix[1:]} ({size:.0f} MB)"
            print(f"first plot of {said}: {statistics.median(taken):.2f} s")
        print(
            f"doctor's picture of {LAST_LOGS_READ} samples after 'Save the card':"
            f" {_doctor(person, folder):.2f} s"
        )
    finally:
        person.quit()


def _plot(person: Person, path: Path) -> float:
    person.go("/drop")
    person.find("#log").send_keys(str(path))
    begun = time.perf_counter()
    person.find("#zone button").click()
    person.until(lambda: person.inked("#columns"), "not drawn")
    took = time.perf_counter() - begun
    rests = "return document.getElementById('words')?.childElementCount > 0"
    person.until(lambda: person.driver.execute_script(rests), "the doctor has no words")
    return took


def _doctor(person: Person, folder: Path) -> float:
    """Median time from a corrected card to the doctor's picture."""
    (path, _), taken = _logs(folder, LAST_LOGS_READ), list[float]()
    _plot(person, path)
    person.until(lambda: person.inked("#picture"), "no picture")
    for _ in range(3):
        person.driver.execute_script("document.getElementById('picture').replaceChildren()")
        begun = time.perf_counter()
        person.find("#card button[type=submit]").click()
        person.until(lambda: person.inked("#picture"), "no picture")
        taken.append(time.perf_counter() - begun)
    return statistics.median(taken)


def _logs(folder: Path, samples: int) -> list[Path]:
    """A log of a machine that moves to and fro, as CSV and Parquet."""
    import pandas as pd

    rng, t = np.random.default_rng(0), 1e-3 * np.arange(samples)
    y = 50.0 * np.sin(0.7 * t) + 10.0 * np.sin(3.1 * t)
    columns = {
        "time [s]": t,
        "position [mm]": y + 0.01 * rng.standard_normal(samples),
        "force [N]": 20.0 * np.sign(np.gradient(y)) + rng.standard_normal(samples),
    }
    frame = pd.DataFrame(columns).round(5)
    out = [folder / "long.csv", folder / "long.parquet"]
    frame.to_csv(out[0], index=False)
    frame.to_parquet(out[1])
    return out


if __name__ == "__main__":
    main()
