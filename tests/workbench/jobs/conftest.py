"""Jobs on both databases."""

from tests.workbench.registry.conftest import postgres, registry, where

__all__ = ["postgres", "registry", "where"]
