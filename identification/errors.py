"""Errors that a user can cause: one line each, shown by the command line with exit status 2."""


class UserError(Exception):
    """What was found, where, what is needed and what to do, in one line."""


class BadCard(UserError):
    """A card that cannot be read or contradicts itself."""


class BadLog(UserError):
    """A log that cannot be read or cannot be what its card says."""


class ShortLog(BadLog):
    """A log with too few samples in a row, which is left out beside others."""


class BadModel(UserError):
    """A model, design or parameter set outside what the equations allow."""


class BadSpecification(UserError):
    """A design specification that no controller can meet."""


class NotIdentifiable(UserError):
    """A log that says nothing on what was asked; the answer is a refusal, not a fault."""
