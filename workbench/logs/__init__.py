"""Log files: found, read in any format, as runs in SI."""
