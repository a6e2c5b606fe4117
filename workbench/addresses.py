"""Addresses as they may be shown: without user, password and query."""

import re
from urllib.parse import unquote

_USER = re.compile(r"(?<=://).*@", re.S)
_QUERY = re.compile(r"\?.*=.*", re.S)


def shown(address: str) -> str:
    """The address without what may be secret in it; a path or pattern as it is."""
    if "://" not in address:
        return address
    return _QUERY.sub("?...", _USER.sub("...@", address))


def without_secrets(text: str, address: str) -> str:
    """The text, as an error says it, without the address's user, password and query values."""
    if "://" not in address:
        return text
    user = "".join(_USER.findall(address)).removesuffix("@")
    query = "".join(_QUERY.findall(address))
    values = [part.partition("=")[2] for part in query[1:].split("&")]
    for secret in (user, user.partition(":")[2], query[1:], *values):
        for form in (secret, unquote(secret)):
            text = text.replace(form, "...") if form else text
    return text
