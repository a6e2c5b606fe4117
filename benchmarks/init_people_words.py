"""Headers of the files of `init_people`: languages and channel names that no word list holds.

What they call a column says nothing to who does not know the language, or the plant: the signals'
own course has to. Those of "judge" were written before the first run on them.
"""

from collections.abc import Mapping

Words = Mapping[str, tuple[str, ...]]

_POLISH: Words = {
    "t": ("czas", "Czas"), "y": ("położenie", "Polozenie osi"), "v": ("prędkość",),
    "a": ("przyspieszenie",), "r": ("zadane",), "target": ("cel",), "u": ("napięcie",),
    "u0": ("regulator",), "ff": ("sprzężenie",), "F": ("siła",), "current": ("prąd",),
    "pred": ("prognoza",), "e": ("uchyb",), "temperature": ("grzanie",), "supply": ("zasilanie",),
    "mode": ("tryb",), "state": ("stan",), "n": ("lp",), "constant": ("wersja",),
    "i2t": ("obciążalność",), "p_p": ("ciśnienie A",), "p_n": ("ciśnienie B",),
}  # fmt: skip
_PORTUGUESE: Words = {
    "t": ("instante",), "y": ("posição", "deslocamento"), "v": ("velocidade",),
    "a": ("aceleração",), "r": ("posição desejada",), "target": ("destino",), "u": ("tensão",),
    "u0": ("saída do controlador",), "ff": ("antecipação",), "F": ("força",),
    "current": ("corrente",), "pred": ("previsão",), "e": ("erro",),
    "temperature": ("temperatura",), "supply": ("alimentação",), "mode": ("habilitado",),
    "state": ("estado",), "n": ("amostra",), "constant": ("versão",), "i2t": ("carga térmica",),
    "p_p": ("pressão A",), "p_n": ("pressão B",),
}  # fmt: skip
_TAGS: Words = {
    "t": ("TS", "t"), "y": ("ZT101", "PV_101"), "v": ("ST102",), "a": ("YT103",), "r": ("ZC101",),
    "target": ("ZS100",), "u": ("EY104",), "u0": ("EC104",), "ff": ("EX105",), "F": ("WT106",),
    "current": ("IT107",), "pred": ("ZX108",), "e": ("ZD109",), "temperature": ("TT110",),
    "supply": ("ET111",), "mode": ("HS112",), "state": ("KS113",), "n": ("KQ114",),
    "constant": ("XX115",), "i2t": ("IQ116",), "p_p": ("PT117",), "p_n": ("PT118",),
}  # fmt: skip
_SWEDISH: Words = {
    "t": ("tid",), "y": ("läge", "axelläge"), "v": ("hastighet",), "a": ("fart_derivata",),
    "r": ("börvärde",), "target": ("mål",), "u": ("styrsignal",), "u0": ("regulatorut",),
    "ff": ("framkoppling",), "F": ("dragkraft",), "current": ("ström",), "pred": ("prognos",),
    "e": ("avvikelse",), "temperature": ("värme",), "supply": ("matning",), "mode": ("aktiv",),
    "state": ("läge_kod",), "n": ("nummer",), "constant": ("utgåva",), "i2t": ("belastning",),
    "p_p": ("tryck A",), "p_n": ("tryck B",),
}  # fmt: skip
_KOREAN: Words = {
    "t": ("시간",), "y": ("위치", "변위"), "v": ("속도",), "a": ("가속도",), "r": ("목표",),
    "target": ("최종목표",), "u": ("전압",), "u0": ("제어출력",), "ff": ("피드포워드",),
    "F": ("힘", "하중"), "current": ("전류",), "pred": ("예측",), "e": ("오차",),
    "temperature": ("온도",), "supply": ("전원",), "mode": ("허용",), "state": ("상태",),
    "n": ("번호",), "constant": ("버전",), "i2t": ("부하율",), "p_p": ("압력A",),
    "p_n": ("압력B",),
}  # fmt: skip
_RUSSIAN: Words = {
    "t": ("время",), "y": ("положение", "координата"), "v": ("скорость",), "a": ("ускорение",),
    "r": ("задание",), "target": ("цель",), "u": ("напряжение",), "u0": ("регулятор",),
    "ff": ("упреждение",), "F": ("усилие",), "current": ("ток",), "pred": ("прогноз",),
    "e": ("рассогласование",), "temperature": ("нагрев",), "supply": ("питание",),
    "mode": ("режим",), "state": ("состояние",), "n": ("номер",), "constant": ("версия",),
    "i2t": ("перегрузка",), "p_p": ("давление 1",), "p_n": ("давление 2",),
}  # fmt: skip
_CHANNELS: Words = {
    "t": ("K0",), "y": ("K1",), "v": ("K2",), "a": ("K3",), "r": ("K4",), "target": ("K5",),
    "u": ("K6",), "u0": ("K7",), "ff": ("K8",), "F": ("K9",), "current": ("K10",),
    "pred": ("K11",), "e": ("K12",), "temperature": ("K13",), "supply": ("K14",),
    "mode": ("K15",), "state": ("K16",), "n": ("K17",), "constant": ("K18",), "i2t": ("K19",),
    "p_p": ("K20",), "p_n": ("K21",),
}  # fmt: skip
_ENGLISH: Words = {
    "t": ("time", "t"), "y": ("actual_position", "q"), "v": ("actual_velocity", "actual_speed"),
    "a": ("actual_acceleration",), "r": ("commanded_position",), "target": ("target_position",),
    "u": ("motor_voltage",), "u0": ("controller_out",), "ff": ("feedforward",),
    "F": ("torque_estimate", "force"), "current": ("motor_current", "iq_measured"),
    "pred": ("predicted_position",), "e": ("tracking_error",), "temperature": ("motor_temp",),
    "supply": ("bus_voltage",), "mode": ("enabled",), "state": ("state",), "n": ("seq",),
    "constant": ("fw_version",), "i2t": ("i2t",), "p_p": ("pressure_cap",),
    "p_n": ("pressure_rod",),
}  # fmt: skip
_GERMAN: Words = {
    "t": ("Zeit",), "y": ("Istlage",), "v": ("Istdrehzahl", "Istgeschwindigkeit"),
    "a": ("Istbeschleunigung",), "r": ("Solllage",), "target": ("Ziellage",),
    "u": ("Ankerspannung",), "u0": ("Reglerausgang",), "ff": ("Vorsteuerung",),
    "F": ("Istmoment", "Kraft"), "current": ("Iststrom", "Strom_q"), "pred": ("Lage_Modell",),
    "e": ("Schleppfehler",), "temperature": ("Wicklungstemperatur",),
    "supply": ("Zwischenkreisspannung",), "mode": ("Reglerfreigabe",), "state": ("Zustand",),
    "n": ("lfdNr",), "constant": ("Firmware",), "i2t": ("I2t-Auslastung",),
    "p_p": ("Druck A",), "p_n": ("Druck B",),
}  # fmt: skip
PEOPLE: Mapping[str, Mapping[str, Words]] = {
    "choose": {"english": _ENGLISH, "polish": _POLISH, "portuguese": _PORTUGUESE, "tags": _TAGS},
    "judge": {"german": _GERMAN, "swedish": _SWEDISH, "korean": _KOREAN, "russian": _RUSSIAN,
              "channels": _CHANNELS},
}  # fmt: skip
KNOWN = ("english", "german")  # languages whose words the lists of `init` hold
