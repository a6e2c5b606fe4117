"""Which part of a command's bar each stage of its computation takes."""

IDENTIFY_STAGES = {
    "refining": (0.0, 0.4),
    "searching": (0.4, 0.6),
    "weighing": (0.5, 0.95),
    "posterior": (0.6, 1.0),
}
TRACE_STAGES = {
    "recording": (0.0, 0.03),
    "refining": (0.03, 0.35),
    "tracing": (0.35, 0.55),
    "refitting": (0.55, 0.75),
    "judging": (0.75, 0.9),
    "settling": (0.45, 0.5),
    "searching": (0.5, 0.7),
    "weighing": (0.6, 0.95),
    "telling": (0.95, 1.0),
}
