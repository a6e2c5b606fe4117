"""`workbench serve` in processes of its own, on a registry and a folder of machines."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

STARTS_WITHIN = 120.0  # s, on a busy machine
ENDS_WITHIN = 60.0  # s


@dataclass
class Served:
    """The command, its address, and what it says on standard error."""

    process: "subprocess.Popen[bytes]"
    address: str
    log: Path

    def wait(self) -> None:
        """Until it answers; raises with what it said where it does not."""
        end = time.monotonic() + STARTS_WITHIN
        while time.monotonic() < end:
            if self.process.poll() is not None:
                break
            try:
                if httpx.get(f"{self.address}/health", timeout=5.0).status_code == 200:
                    return
            except httpx.TransportError:
                time.sleep(0.1)
        raise RuntimeError(self.log.read_text())

    def stop(self, how: signal.Signals = signal.SIGTERM) -> int:
        """End it; its exit status."""
        self.process.send_signal(how)
        return self.process.wait(ENDS_WITHIN)


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@contextmanager
def serving(where: str, root: Path, *options: str) -> Iterator[Served]:
    """The page, served until the block ends."""
    port, log = free_port(), root.parent / f"serve-{os.urandom(3).hex()}.log"
    command = [sys.executable, "-m", "workbench", "serve", "--machines", str(root)]
    command += ["--port", str(port), *options]
    environment = {**os.environ, "WORKBENCH_REGISTRY": where, "OMP_NUM_THREADS": "1"}
    with log.open("wb") as said:
        process = subprocess.Popen(command, env=environment, stderr=said, stdout=said)
    served = Served(process, f"http://127.0.0.1:{port}", log)
    try:
        served.wait()
        yield served
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(ENDS_WITHIN)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
