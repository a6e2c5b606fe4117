"""Units as logs of machines write them, in the languages of their loggers."""

import re
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

Quantity = Literal[
    "time", "position", "velocity", "acceleration", "force", "pressure", "command", "temperature",
    "count", "other",
]  # fmt: skip


@dataclass(frozen=True)
class WrittenUnit:
    """A unit as cards write it, what it measures, and whether of a turning machine."""

    card: str
    quantity: Quantity
    rotary: bool = False

    @property
    def plain(self) -> str:
        """The unit without a number before it: rpm of "0.1 rpm"."""
        return self.card.lstrip("0123456789. ") or self.card


_SPELT: Mapping[Quantity, str] = {  # card's unit: spellings
    "time": "s: s sec secs second seconds sekunde sekunden 秒; ms: ms msec msecs millis 毫秒"
    " milliseconds millisekunden ミリ秒; us: us µs usec micros microseconds mikrosekunden 微秒;"
    " ns: ns nsec nanoseconds; min: min minutes minuten 分 分钟",
    "position": "m: m meter metre meters 米; mm: mm millimeter millimetre ミリ 毫米; cm: cm 厘米;"
    " um: um µm micron microns mikrometer micrometer 微米; nm: nm 纳米;"
    " inch: in inch inches zoll; foot: ft",
    "velocity": "m/s: m/s mps m/sec meters/sec 米/秒; mm/s: mm/s mmps mm/sec 毫米/秒;"
    " um/s: um/s µm/s; cm/s: cm/s; inch/s: in/s ips; m/min: m/min; mm/min: mm/min",
    "acceleration": "m/s^2: m/s^2 m/s² m/s2 m/s**2; mm/s^2: mm/s^2 mm/s² mm/s2",
    "force": "N: n newton newtons 牛 牛顿; kN: kn 千牛; mN: mn; lbf: lbf lb lbs;"
    " kip: kip; kgf: kgf kp kg",
    "pressure": "bar: bar barg bara bar(g) 巴; mbar: mbar 毫巴; Pa: pa pascal 帕;"
    " kPa: kpa 千帕; hPa: hpa; MPa: mpa 兆帕; psi: psi psig psia; atm: atm;"
    " kgf/cm^2: kgf/cm2 kgf/cm² kgf/cm^2",
    "command": "V: v volt volts vdc vrms 伏 伏特; mV: mv 毫伏;"
    " A: a amp amps ampere arms apk adc 安 安培;"
    " mA: ma 毫安; %: % pct percent prozent"
    " %pwm %duty; 1: 1 - dimensionless",
    "count": "count: count counts counts16bit counts32bit cnt cnts inc"
    " incs ink inkremente increments pulse pulses pls"
    " パルス 脉冲 ticks tick digits digit dig lsb steps",
    "temperature": "degC: °c ℃ degc deg_c celsius c 摄氏度; degF: °f degf; K: k kelvin",
}
_SPELT_ROTARY: Mapping[Quantity, str] = {
    "position": "rad: rad radians 弧度; mrad: mrad; deg: deg degree degrees ° grad 度;"
    " turn: turn turns rev revs rot rotation rotations u umdr umdrehungen 回転 转",
    "velocity": "rad/s: rad/s rads radps rad/sec radians/sec; deg/s: deg/s °/s dps degps deg/sec"
    " degrees/sec; rpm: rpm u/min 1/min min-1"
    " 转/分 r/min rev/min upm; turn/s: rev/s turn/s rps rotations/sec rot/sec",
    "acceleration": "rad/s^2: rad/s^2 rad/s² rad/s2; deg/s^2: deg/s^2 deg/s² deg/s2 °/s² °/s^2",
    "force": "N m: nm n·m n.m n*m n-m newtonmeter 牛米 牛·米; mN m: mnm mn·m; N cm: ncm;"
    " lbf inch: lb-in lbf-in in-lb; lbf foot: lb-ft ft-lb lbf-ft; ozf inch: oz-in ozin;"
    " kgf cm: kgf-cm kgf·cm kgfcm kg-cm kg·cm kgcm; N mm: nmm n·mm n-mm",
}


def _table() -> Iterator[tuple[str, WrittenUnit]]:
    for spelt, rotary in ((_SPELT, False), (_SPELT_ROTARY, True)):
        for quantity, line in spelt.items():
            for entry in line.split(";"):
                card, _, spellings = entry.strip().partition(": ")
                for one in spellings.split():
                    yield one, WrittenUnit(card, quantity, rotary)


# "nm" stands for both nanometres and newton metres; its case says which.
_UNITS = dict(_table())
_NEWTON_METRE, _NANOMETRE = _UNITS["nm"], WrittenUnit("nm", "position")
_SCALED = re.compile(r"(\d*[.,]?\d+)\s*([^\W\d].*|%.*|°.*)")


def written_unit(text: str) -> WrittenUnit | None:
    """The unit of that spelling; None where it is none that logs of machines have."""
    found = unicodedata.normalize("NFKC", text).strip()
    if found in ("nm", "Nm", "NM"):
        return _NANOMETRE if found == "nm" else _NEWTON_METRE
    if found in ("mpa", "MPa", "MPA"):  # no log is in millipascal
        return _UNITS["mpa"]
    if found == "mN":
        return _UNITS["mn"]
    if found.startswith("% "):  # of what: "% of rated torque"
        return _UNITS["%"]
    if scaled := _SCALED.fullmatch(found):  # "0.1 rpm"
        own = written_unit(scaled[2])
        return replace(own, card=f"{scaled[1].replace(',', '.')} {own.card}") if own else None
    found = found.replace("μ", "µ").casefold().replace("μ", "µ")
    plain = found.replace(" ", "")
    return _UNITS.get(found) or _UNITS.get(plain) or _UNITS.get(plain.replace(".", "-"))
