"""Alembic's environment of the registry."""
