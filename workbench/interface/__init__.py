"""The commands as functions of Python: tables, paths and keywords in, results with pictures out."""
