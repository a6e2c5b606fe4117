"""A model made of logs: identified, traced, that of a valve; and what the logs identify."""
