"""The syntax of Structured Text, IEC 61131-3."""

from dataclasses import dataclass

from workbench.export.exported import Precision
from workbench.export.syntax import Syntax, braced

# Words of the standard, and operators of its Instruction List, that a name here may meet.
RESERVED = ("s", "n", "d", "l", "p", "t", "in", "to", "by", "of", "on", "step", "limit", "mod")
OWN = "_1"  # behind such a name


@dataclass(frozen=True)
class StructuredText(Syntax):
    """Structured Text with the plain elements of every edition."""

    def number(self, value: float) -> str:
        digits, _, power = repr(self.rounded(value)).upper().partition("E")
        mantissa = digits if "." in digits else digits + ".0"
        return f"{mantissa}E{int(power)}" if power else mantissa

    def assigned(self, target: str, value: str) -> str:
        return f"{target} := {value};"

    def chosen(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        head = [f"IF {condition} THEN", *braced(then)]
        return [*head, "END_IF;"] if not otherwise else [
            *head, "ELSE", *braced(otherwise), "END_IF;"
        ]  # fmt: skip

    def repeated(self, index: str, count: int, body: list[str]) -> list[str]:
        return [f"FOR {index} := 0 TO {count - 1} DO", *braced(body), "END_FOR;"]

    def remark(self, text: str) -> str:
        return f"(* {text.replace('*)', '* )')} *)"


def st_syntax(precision: Precision) -> StructuredText:
    """Structured Text in LREAL or REAL."""
    return StructuredText(
        precision=precision,
        symbols={
            "+": "+", "-": "-", "*": "*", "/": "/", "negative": "-", "not": "NOT ",
            "and": "AND", "or": "OR", "==": "=", "!=": "<>", "<": "<", "<=": "<=", ">": ">",
            ">=": ">=",
        },
        functions={"min": "MIN", "max": "MAX", "abs": "ABS"},
        names={"r": "r_ref", **{word: word + OWN for word in RESERVED}},
    )  # fmt: skip
