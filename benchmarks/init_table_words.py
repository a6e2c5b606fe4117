"""Kinds of tables and words of their headers for `init_real_tables`: to choose by, to judge by."""

from collections.abc import Mapping
from dataclasses import dataclass, field

Words = Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class Kind:
    """What a table holds: names of signals, those that are never left out, what drives the body,
    its axes with the pattern of their headers, units that are possible, how often units are shown,
    counts of a turn (0: SI), and by which words a signal goes."""

    said: str
    holds: tuple[str, ...]
    needs: tuple[str, ...]
    drive: str
    kinds: tuple[str, ...]
    rotary: bool
    axes: tuple[str, ...] = ()
    pattern: str = "{word}{axis}"
    unit_of: Mapping[str, list[str]] = field(default_factory=dict)
    units: float = 0.5
    counts: int = 0
    called: Mapping[str, str] = field(default_factory=dict)
    suffix: str = ".csv"


_TURNS = {"y": ["rad"], "v": ["rad/s"], "u": ["A"], "F": ["Nm"]}
_DEGREES = {"y": ["deg"], "v": ["deg/s"], "u": ["A"], "F": ["Nm"]}
_SLIDES = {"y": ["mm", "m"], "v": ["mm/s"], "u": ["V"], "F": ["N"]}
_OF_CURRENT = {"u": "current", "u0": "current set"}
KINDS: Mapping[str, tuple[Kind, ...]] = {
    "choose": (
        Kind("servo with current", ("y", "v", "u", "r", "u0", "id", "e"), ("y", "u"), "u",
             ("motor",), True, unit_of=_TURNS, called=_OF_CURRENT),
        Kind("robot of three joints", ("y", "v", "F", "r"), ("y", "F"), "F", ("force",), True,
             ("1", "2", "3"), "joint{axis}_{word}", _TURNS, 0.3),
        Kind("linear axis by voltage", ("y", "v", "a", "u", "u0", "ff", "r", "target"), ("y", "u"),
             "u", ("motor",), False, unit_of=_SLIDES, units=1.0),
        Kind("servo beside a model", ("y", "F", "pred", "r", "e"), ("y", "F"), "F", ("force",),
             True, unit_of=_TURNS, units=0.5),
        Kind("archive of a joint", ("y", "v", "F", "r"), ("y", "F"), "F", ("force",), True,
             unit_of=_TURNS, units=0.0, suffix=".npz"),
    ),
    "judge": (
        Kind("drive with counts", ("y", "u", "r", "u0", "id"), ("y", "u"), "u", ("motor",), True,
             unit_of={"u": ["A"]}, counts=4096, called=_OF_CURRENT),
        Kind("gantry of two axes", ("y", "v", "u", "r", "target"), ("y", "u"), "u", ("motor",),
             False, ("x", "z"), "{axis}_{word}", _SLIDES, 1.0),
        Kind("test stand with a load cell", ("y", "v", "a", "F", "target", "r"), ("y", "F"), "F",
             ("force",), False, unit_of=_SLIDES, units=0.9, called={"F": "force"}),
        Kind("pendulum in degrees", ("y", "v", "F", "pred", "e"), ("y", "F"), "F", ("force",),
             True, unit_of=_DEGREES, units=1.0),
        Kind("leg of two joints", ("y", "v", "u", "r"), ("y", "u"), "u", ("motor",), True,
             ("hip", "ankle"), "{axis}_{word}", _TURNS, 0.3, called=_OF_CURRENT),
        Kind("limited loop", ("y", "v", "u0", "ff", "u", "r", "target"), ("y", "u", "u0"), "u",
             ("motor",), True, unit_of={"y": ["rad"], "v": ["rad/s"], "u": ["V"]}),
    ),
}  # fmt: skip
_ENGLISH: Words = {
    "t": ("time", "Time"), "y": ("position", "pos"), "v": ("velocity", "vel"),
    "a": ("acceleration", "acc"), "r": ("demand_position", "pos_ref", "setpoint"),
    "target": ("target_position", "goal"), "u": ("motor_voltage", "applied_voltage"),
    "u0": ("control_output", "controller"), "ff": ("feedforward",), "F": ("torque", "effort"),
    "force": ("force", "load_cell"),
    "current": ("iq_measured", "motor_current", "Iq"), "current set": ("iq_setpoint", "Iq_ref"),
    "id": ("id_measured", "Id"), "pred": ("pred_position", "pos_hat", "model_pos"),
    "e": ("error", "pos_error"), "temperature": ("temp", "motor_temperature"),
    "supply": ("vbus", "supply_voltage"), "mode": ("enabled", "torque_enable"),
    "state": ("state", "mode"), "n": ("index", "sample"), "constant": ("gain", "version"),
}  # fmt: skip
_GERMAN: Words = {
    "t": ("Zeit",), "y": ("Istposition", "Lage"), "v": ("Geschwindigkeit", "Drehzahl"),
    "a": ("Beschleunigung",), "r": ("Sollposition",), "target": ("Zielposition",),
    "u": ("Motorspannung",), "u0": ("Reglerausgang",), "ff": ("Vorsteuerung",),
    "F": ("Drehmoment", "Moment"), "force": ("Kraft",), "current": ("Strom", "Motorstrom"),
    "current set": ("Sollstrom",), "id": ("Id",), "pred": ("Modell_Position",),
    "e": ("Regelabweichung",), "temperature": ("Temperatur",), "supply": ("Versorgung",),
    "mode": ("Freigabe",), "state": ("Zustand",), "n": ("Nr",), "constant": ("Version",),
}  # fmt: skip
_DRIVES: Words = {
    "t": ("Time", "TimeStamp"), "y": ("ActPos", "Position actual value", "encoder"),
    "v": ("ActVel", "Velocity actual value"), "a": ("ActAcc", "Acceleration"),
    "r": ("DemPos", "Position demand value"), "target": ("TargetPos", "Target position"),
    "u": ("plant_input", "output_limited"), "u0": ("pid_output", "output_raw"),
    "ff": ("ff", "feed_forward"), "F": ("Torque", "ActTorque"), "force": ("Load cell", "Force"),
    "current": ("I_q", "Motor current"),
    "current set": ("I_q_cmd", "Current demand"), "id": ("I_d", "i_d"),
    "pred": ("nn_prediction", "sim_pos"), "e": ("Following error", "PosDiff"),
    "temperature": ("DriveTemp", "Heatsink temperature"), "supply": ("DC link voltage", "Udc"),
    "mode": ("Enable", "Function activated"), "state": ("StatusWord", "AxisState"),
    "n": ("Counter", "Sample"), "constant": ("Kp", "Version"),
}  # fmt: skip
_JAPANESE: Words = {
    "t": ("時間", "経過時間"), "y": ("現在位置", "実位置"), "v": ("速度",), "a": ("加速度",),
    "r": ("位置指令",), "target": ("目標位置",), "u": ("モータ電圧",), "u0": ("制御出力",),
    "ff": ("フィードフォワード", "ff"), "F": ("トルク",), "force": ("荷重",),
    "current": ("電流", "モータ電流"),
    "current set": ("電流指令",), "id": ("d軸電流",), "pred": ("予測位置",), "e": ("位置偏差",),
    "temperature": ("温度",), "supply": ("電源電圧",), "mode": ("アラーム", "サーボ状態"),
    "state": ("状態",), "n": ("番号",), "constant": ("バージョン",),
}  # fmt: skip
_FRENCH: Words = {
    "t": ("temps",), "y": ("position mesurée", "position"), "v": ("vitesse",),
    "a": ("accélération",), "r": ("consigne de position",), "target": ("position cible",),
    "u": ("tension moteur",), "u0": ("sortie régulateur",), "ff": ("anticipation",),
    "F": ("couple",), "force": ("effort", "force"), "current": ("courant moteur",),
    "current set": ("courant consigne",),
    "id": ("courant d",), "pred": ("position prédite",), "e": ("erreur",),
    "temperature": ("température",), "supply": ("tension bus",), "mode": ("actif",),
    "state": ("état",), "n": ("numéro",), "constant": ("version",),
}  # fmt: skip
LANGUAGES: Mapping[str, Mapping[str, Words]] = {
    "choose": {"english": _ENGLISH, "german": _GERMAN},
    "judge": {"drives": _DRIVES, "japanese": _JAPANESE, "french": _FRENCH},
}
