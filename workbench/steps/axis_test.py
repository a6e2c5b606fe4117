"""The test of one log of an axis by its card."""

from design.measured.axis_test import AxisTest, Earlier, axis_test
from design.measured.card_limits import limit_units
from workbench.logs.sources import Sources


def axis_test_of_sources(
    sources: Sources, earlier: Earlier | None = None, machine: str | None = None
) -> AxisTest:
    """The test of the longest run of the sources, by the limits of their card.

    earlier: what the registry has of the machine. Raises NotIdentifiable where too little slides.
    """
    units = limit_units(sources.rig)
    return axis_test(sources.logs, sources.card.limits, units, earlier, machine)
