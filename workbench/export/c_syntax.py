"""The syntax of C99."""

from dataclasses import dataclass

from design.program import Program
from workbench.export.exported import Precision
from workbench.export.syntax import Syntax, braced, state_names

# Python's names that are keywords of C, and one of a function of its library.
C_KEYWORDS = (
    "auto", "case", "char", "const", "default", "do", "double", "enum", "extern", "float", "goto",
    "inline", "int", "long", "register", "restrict", "short", "signed", "sizeof", "static",
    "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "free",
)  # fmt: skip


@dataclass(frozen=True)
class C(Syntax):
    """C99; states are members of a structure `s`."""

    def number(self, value: float) -> str:
        suffix = "f" if self.precision == "single" else ""
        return repr(self.rounded(value)) + suffix

    def assigned(self, target: str, value: str) -> str:
        return f"{target} = {value};"

    def chosen(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        head = [f"if ({condition}) {{", *braced(then)]
        return [*head, "}"] if not otherwise else [*head, "} else {", *braced(otherwise), "}"]

    def repeated(self, index: str, count: int, body: list[str]) -> list[str]:
        return [f"for ({index} = 0; {index} < {count}; ++{index}) {{", *braced(body), "}"]

    def remark(self, text: str) -> str:
        return f"/* {text.replace('*/', '* /')} */"


def c_syntax(program: Program, precision: Precision) -> C:
    """C for this program: its functions for min, max and abs bear its name."""
    short = program.name
    return C(
        precision=precision,
        symbols={
            "+": "+", "-": "-", "*": "*", "/": "/", "negative": "-", "not": "!", "and": "&&",
            "or": "||", "==": "==", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">=",
        },
        functions={"min": f"{short}_min", "max": f"{short}_max", "abs": f"{short}_abs"},
        names={word: f"{word}_" for word in C_KEYWORDS},
        states=state_names(program),
        kept="s->",
    )  # fmt: skip
