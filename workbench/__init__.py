"""The shell: commands, cards, log files, reports."""
