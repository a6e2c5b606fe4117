"""Addresses and what errors say of them, without what may be secret."""

import pytest

from workbench.addresses import shown, without_secrets


@pytest.mark.parametrize(
    ("address", "expected"),
    [
        ("logs/run?.parquet", "logs/run?.parquet"),
        ("s3://bucket/*/run?.parquet", "s3://bucket/*/run?.parquet"),
        ("ftp://me:geheim@host:21/x", "ftp://...@host:21/x"),
        ("ftp://me:ge@he/im@host/x", "ftp://...@host/x"),
        ("https://host/x?token=geheim&a=1", "https://host/x?..."),
        ("zip://a::http://me:geheim@host/x.zip", "zip://...@host/x.zip"),
        ("http://me:ge\nheim@host", "http://...@host"),
    ],
)
def test_what_is_shown(address: str, expected: str) -> None:
    assert shown(address) == expected


def test_errors_that_quote_an_address() -> None:
    address = "http://me:ge%20heim@host/x?token=abc&mode="
    for said in (address, "user 'me:ge heim' refused", "no ge%20heim here", "bad abc"):
        found = without_secrets(said, address)
        assert "heim" not in found and "abc" not in found
    assert without_secrets("no logs", "logs") == "no logs"
    assert without_secrets("no host", address) == "no host"
