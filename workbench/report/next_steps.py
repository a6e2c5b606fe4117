"""What to type after a refusal or an alarm: one command, with the names of the files at hand."""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.files import CARD_FILE, shipped_cards
from workbench.output import Step, step

if TYPE_CHECKING:
    from design.controllers.validate import Validation
    from design.identified.examined import Examined
    from design.machine.design import Controller, Design
    from design.machine.model import Model
    from design.machine.velocity import VelocityModel
    from design.measured.drift_of_logs import Drifted
    from design.robust.robust import Robust
    from workbench.steps.demo import Demonstration

SLOWER, FASTER = 0.7, 1.4  # of the natural frequency that a loop is tried with next
TWO_DIGITS = 100.0


def check_of_refused(logs: Sequence[str], card: str) -> Callable[[str], Step]:
    """After a refusal of logs: look at the one that its reason names, else at the first."""

    def then(reason: str) -> Step:
        named = (log for log in logs if Path(log).name in reason)
        log = next(named, logs[0] if logs else "LOG")
        return step("which run to add", "doctor", log, "--card", card)

    return then


def after_identify(model: "Model", logs: Sequence[str], card: str, folder: Path) -> Step:
    """Trace what the model lacks; design on one that leaves noise; the run to add where none of its
    parameters is identified, so that too little slides to test, or where it carries no design."""
    from workbench.report.model_tables import to_the_noise_by_equation

    fitted = {Path(one.file).name for one in model.log}  # of several logs one may be left out
    logs = [log for log in logs if Path(log).name in fitted] or logs
    if model.fit.adequate:
        return _design_or_run(model, logs, card, folder)
    by_steps = model.by_equation and model.fit.force_relative is None
    if not model.identifies_friction or model.identifies_one_way or by_steps:  # no trace takes them
        return check_of_refused(logs, card)("")
    why = "whether an" if to_the_noise_by_equation(model) else "an"
    return step(f"{why} effect is missing", "trace", *logs, "--card", card)


def after_trace(
    verdict: str, effects: Iterable[object], model: "Model | VelocityModel", logs: Sequence[str],
    card: str, folder: Path,
) -> Step | None:  # fmt: skip
    """The newer logs' own model after drift, a controller where the model is as good as it gets.

    logs: the newer ones. None where more has to be logged or known first.
    """
    if verdict == "drift":
        return step("the machine as it is now", "identify", *logs, "--card", card)
    if verdict == "none" or list(effects):
        return _design_or_run(model, logs, card, folder)
    return None


def _design_or_run(
    model: "Model | VelocityModel", logs: Sequence[str], card: str, folder: Path
) -> Step:
    """A controller where the model carries a design, else which run to add to its logs."""
    from design.closed_loop.linear_loop import carries_design
    from design.controllers.velocity_loop import DESIGN_NEEDS
    from design.machine.velocity import VelocityModel

    if isinstance(model, VelocityModel):
        carries = all(model.valve[name].known for name in DESIGN_NEEDS)
    else:
        carries = carries_design(model)
    if carries:
        return step("a controller for it", "design", folder / "model.json")
    return check_of_refused(logs, card)("")


def after_predict(log: str, card: str, *, one_way: bool = False) -> Step:
    """What a model lacks on a log; of motion one way, which no trace takes, which run to add."""
    if one_way:
        return check_of_refused([log], card)("")
    return step("what is missing, where that is more than noise", "trace", log, "--card", card)


def without_design(model: "Model | VelocityModel", card: str | None) -> Callable[[str], Step]:
    """After a refusal to design: look over the log that the model is of."""
    logs, known = _files_of(model, card)
    return check_of_refused(logs, known)


def _files_of(model: "Model | VelocityModel", card: str | None) -> tuple[list[str], str]:
    """The model's logs and its card: given, shipped, or where it is likely to lie; LOG and CARD of
    those that are not there, since a model knows the names of its files alone."""
    shipped, likely = shipped_cards(), (Path(model.card) / CARD_FILE, Path(CARD_FILE))
    if card is None and model.card in shipped:
        card = model.card
    known = card or next((str(path) for path in likely if path.is_file()), "CARD")
    names = dict.fromkeys(one.file for one in model.log)
    found = [name for name in names if known in shipped or Path(name).is_file()]
    return found or ["LOG"], known


def after_design(
    found: "Design", model_file: Path, asked_poles: bool, options: Iterable[str], folder: Path
) -> Step:
    """A check in simulation; where no controller keeps the goals, what the best of them does keep.

    options: the other options of the command.
    """
    if found.recommended != "none":
        return in_simulation(model_file, folder)
    words = ("design", str(model_file), *options)
    if asked_poles:
        return step("poles that meet the goals are searched", *words)
    best = max(found.controllers.values(), key=lambda one: (-len(one.missed), _worst(one)))
    modulus, delay = _floor(_worst(best)), best.margins.delay_samples
    of_margins = all("margin" in missed for missed in best.missed)
    if of_margins and modulus > 0.0:
        samples = math.inf if delay is None else _floor(delay)
        least = () if samples >= 2.0 else ("--delay", f"{samples:g}")
        return step("the goals that can be met", *words, "--modulus", f"{modulus:g}", *least)
    return step("a slower loop", *words, "--poles", _poles(best, SLOWER))


def after_robust(found: "Robust", model_file: Path, folder: Path) -> Step:
    """Where no loop keeps the limits often enough: the run that reduces the uncertainty."""
    if found.passed:
        return in_simulation(model_file, folder)
    return step("the run that reduces the uncertainty", "experiment", model_file)


def in_simulation(model_file: Path, folder: Path) -> Step:
    """After any design: its loops in time."""
    return step("the loop in simulation", "validate", model_file, folder / "design.json")


def as_code(design_file: Path) -> Step:
    """After a validation that a design has passed."""
    return step("as code for the drive", "export", design_file, "--to", "c")


def _worst(one: "Controller") -> float:
    return min(one.margins.worst_modulus or 0.0, one.margins.modulus)


def _floor(value: float) -> float:
    return math.floor(TWO_DIGITS * value) / TWO_DIGITS


def _poles(one: "Controller", factor: float) -> str:
    w_n, zeta = one.dominant
    return f"{factor * w_n:.3g},{zeta:.3g}"


def after_validate(
    found: "Validation", of: "Design", model: "Model", model_file: Path, plant_file: Path | None,
    card: str | None,
) -> Step | None:  # fmt: skip
    """What to change where the tested controller misses a limit; None where it keeps all."""
    from design.closed_loop.loop_figures import COMPENSATED

    failed = {place: one for place, one in found.figures[found.judged].items() if not one.passed}
    if not failed:
        return None
    if "model" not in failed and plant_file is not None:
        return step("a design for that machine", "design", plant_file)
    if not model.fit.adequate and not model.effects:
        logs, known = _files_of(model, card)
        return step("an effect is missing", "trace", *logs, "--card", known)
    words = ("design", str(model_file), *(("--card", card) if card else ()))
    alone = found.judged.removesuffix(COMPENSATED)
    if alone != found.judged and found.figures[alone]["model"].passed:
        return step("a design without the compensator", *words)
    one, limits = failed["model"], found.limits
    controller = of.controllers[alone]
    m, pushed = one.margins, one.force_peak > limits.force * one.force_seen or one.limited > 0.0
    slow = m is not None and (m.delay_samples is None or m.delay_samples >= limits.delay)
    if one.stable and not (m is not None and m.modulus >= limits.modulus and slow):
        asked = ("--modulus", f"{limits.modulus:g}", "--delay", f"{limits.delay:g}")
        return step("the margins that were missed", *words, *asked)
    if not one.stable or one.overshoot > limits.overshoot or pushed:
        return step("a slower loop", *words, "--poles", _poles(controller, SLOWER))
    return step("a faster loop", *words, "--poles", _poles(controller, FASTER))


def after_drift(found: "Drifted", logs: Sequence[str], card: str) -> Step | None:
    """Trace another structure, re-tune after drift, check a log from which nothing is
    identifiable."""
    if found.verdict == "none" or (found.verdict == "not_judged" and found.tested):
        return None
    files = {one.source.file for one in found.tests if one.test.verdict == found.verdict}
    named = [log for log in logs if Path(log).name in files] or list(logs)
    if found.verdict == "structure":
        return step("an effect is missing", "trace", *named, "--card", card)
    if found.slip:
        return step("which unit is wrong", "doctor", named[0], "--card", card)
    if found.verdict == "drift":
        return step("the machine as it is now", "identify", *named, "--card", card)
    return step("which run to add", "doctor", named[0], "--card", card)


def after_doctor(found: "Examined", log: str, card: str) -> Step | None:
    """Another card where the log is refused; None where nothing is identifiable from it: no command
    makes more of it."""
    from workbench.report.doctor import advice

    if found.verdict not in ("refused", "nothing"):
        ready = not advice(found)
        return step("what can be known of it", "identify", log, "--card", card) if ready else None
    if found.verdict == "nothing":
        return None
    path = Path(card)
    place = path.with_name(f"{path.stem}-new.toml") if path.suffix else Path(CARD_FILE)
    return step("what the columns seem to be", "init", log, "--out", place)


def after_demo(found: "Demonstration", folder: Path, seed: int) -> Step | None:
    """Another search where the effect was not found, another design where a limit is missed."""
    if not found.named_rightly:
        return step("another search", "demo", "--seed", str(seed + 1))
    model = found.traced.model
    return after_validate(
        found.validation, found.design, model, folder / "model.json", None, model.card
    )
