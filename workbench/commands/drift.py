"""`workbench drift`: new logs against the active model -> drift.json and report.html."""

from pathlib import Path

import click

from workbench import options
from workbench.output import results
from workbench.signature import option


@options.command(
    done="no drift; or INCONCLUSIVE, where no test alarmed but a change that matters is below the"
    " minimum detectable change (the first line says so)",
    refusal="drift, a changed structure, or no log from which anything is identifiable",
    epilog="Example: workbench drift model/model.json day2.csv --card card.toml --state state.json",
)
def command(
    model_file: Path = options.MODEL_ARGUMENT,
    logs: tuple[str, ...] = options.LOGS_ARGUMENT,
    card: str = options.CARD_OPTION,
    state_file: Path | None = option(
        "File that carries the test from log to log; made where there is none.",
        "--state", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE",
    ),
    margin: float = option(
        "Change of a parameter that does not matter [%].", type=options.POSITIVE, default=2.0
    ),
    variation: float = option(
        "Standard deviation of a parameter from log to log [%], until the logs show it.",
        type=options.POSITIVE, default=1.0,
    ),
    run_length: float = option(
        "Logs without drift up to a false alarm, on average, at least.",
        type=options.POSITIVE, default=1000.0,
    ),
    seed: int = options.SEED_OPTION,
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    out: Path | None = options.OUT_OPTION,
) -> int:  # fmt: skip
    """Test new logs against the active model: has the machine changed, and in which parameters?

    Every log is tested alone and, with those before it, by their mean, which finds what changes
    slowly. Writes drift.json and report.html.
    """
    from design.measured.drift_of_logs import drift_of
    from identification.drift.drift_test import DriftSettings
    from workbench.course import working
    from workbench.interface.models import load_model
    from workbench.logs.sources import read_sources
    from workbench.report.next_steps import after_drift, check_of_refused
    from workbench.report.view import view
    from workbench.steps.drift import model_key, read_stream, write_stream

    settings = DriftSettings(margin=margin / 100, variation=variation / 100, run_length=run_length)
    model = load_model(model_file, effects)
    stream = read_stream(state_file) if state_file else None
    sources = read_sources(logs, card)
    with results("drift", out, check_of_refused(logs, card)) as folder:
        with working("testing"):
            found = drift_of(
                model, model_key(model), sources.logs, stream=stream, settings=settings, seed=seed
            )
        shown = view(found, str(model_file))
        shown.write(folder)
    # After the results: a run that is ended between them is simply made again.
    if state_file:
        write_stream(state_file, found.stream)
    then = after_drift(found, logs, card)
    shown.show(folder.final, then)
    return 0 if then is None else 1
