"""What may be wrong with a registry, one line each."""

from identification.errors import UserError


class BadRegistry(UserError):
    """A registry that cannot be used, or a question that it cannot answer."""


class RegistryAway(UserError):
    """A database that does not answer, is locked or full; the same may work later."""


class LostClaim(UserError):
    """A worker's lease has ended and another has taken over; its result is dropped."""
