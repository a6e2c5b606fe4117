"""Compiled runs of a plant, with effects or without: exact steps, along a log."""
