"""Metrics in Prometheus' text format, read from the registry: every worker shows the same."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from prometheus_client import CollectorRegistry, write_to_textfile
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector

from workbench.registry.outbox import Outbox
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import RegistryAway

PREFIX = "servo_workbench"


class MachineFigures(Collector):
    """Figures of all machines at the moment they are asked for; `passed` adds those of a pass."""

    def __init__(self, registry: Registry) -> None:
        self._registry = registry
        self._last: tuple[datetime, int] | None = None

    def passed(self, at: datetime, failed: int) -> None:
        """Note when a pass has ended, and how many machines it could not handle."""
        self._last = (at, failed)

    def collect(self) -> Iterator[GaugeMetricFamily]:
        """The figures; `up` 0 and no others of the registry where it is away."""
        try:
            up, found = 1.0, list(_of_machines(self._registry))
        except RegistryAway:
            up, found = 0.0, []
        yield _family("registry_up", "Whether the registry answers.", value=up)
        yield from found
        if self._last is not None:
            at, failed = self._last
            end = at.timestamp()
            yield _family("last_pass_timestamp_seconds", "End of the last pass.", value=end)
            meaning = "Machines that the last pass could not handle."
            yield _family("machines_failed", meaning, value=failed)


def collected(figures: MachineFigures) -> CollectorRegistry:
    """The figures as a registry of the Prometheus client, of their own."""
    out = CollectorRegistry(auto_describe=False)
    out.register(figures)
    return out


def write_metrics(path: Path, figures: MachineFigures) -> None:
    """Write them for the node exporter's textfile collector, whole or not at all."""
    write_to_textfile(str(path), collected(figures))


def _of_machines(registry: Registry) -> Iterator[GaugeMetricFamily]:
    machines = registry.machines()
    version = _family("version_in_force", "Number of the active version.", "machine")
    waiting = _family("logs_waiting", "Logs that wait for a result.", "machine")
    unsent = _family("alarms_waiting", "Alarms that no webhook has taken yet.", "machine")
    lost = _family("alarms_failed", "Alarms given up, as no webhook took them.", "machine")
    alarms = Outbox(registry.database).counts(datetime.now(UTC))
    for one in machines:
        if one.in_force is not None:
            version.add_metric([one.name], one.in_force.number)
        waiting.add_metric([one.name], one.waiting)
        for family, count in zip((unsent, lost), alarms.get(one.name, (0, 0)), strict=True):
            family.add_metric([one.name], count)
    judged = _family("logs_judged", "Logs by verdict.", "machine", "verdict")
    for labels, count in sorted(Queue(registry.database).verdicts().items()):
        judged.add_metric(list(labels), count)
    yield from (version, waiting, judged, unsent, lost)


def _family(name: str, meaning: str, *labels: str, value: float | None = None) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"{PREFIX}_{name}", meaning, value, labels or None)
