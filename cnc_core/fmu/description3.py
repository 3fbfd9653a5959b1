"""modelDescription.xml, as FMI 3.0 has it (FMI 3.0, section 2.4)."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree

from .description import Model, begun, start_of, varies, written
from .variables import ARRAY, Variable

KINDS = {
    "Real": "Float64",
    "Integer": "Int32",
    "Boolean": "Boolean",
    "String": "String",
}
HLI_TYPE = "application/octet-stream"


def description3(model: Model, tool: str) -> bytes:
    """The file's bytes."""
    words = {"fmiVersion": "3.0", "instantiationToken": model.guid}
    root = begun(model, tool, words, {"canGetAndSetFMUState": "false"})
    declared = ElementTree.SubElement(root, "ModelVariables")
    places = list(_declare(declared, model))
    structure = ElementTree.SubElement(root, "ModelStructure")
    for name in ("Output", "InitialUnknown"):
        for place in places:
            ElementTree.SubElement(
                structure, name, {"valueReference": str(place)}
            )
    return written(root)


def _declare(out: ElementTree.Element, model: Model) -> Iterator[int]:
    """Every variable; the value references of the outputs."""
    count = len(model.variables)
    ElementTree.SubElement(
        out,
        "Float64",
        {
            "name": "time",
            "valueReference": str(count),
            "causality": "independent",
            "variability": "continuous",
        },
    )
    begun_array = ""
    for place, variable in enumerate(model.variables):
        if variable.array and variable.array == begun_array:
            continue
        begun_array = variable.array
        _one(out, place, variable)
        if variable.causality == "output":
            yield place
    ElementTree.SubElement(
        out,
        "Binary",
        {
            "name": "HLI",
            "valueReference": str(count + 1),
            "description": "memory of the channel, HLI_CHANNEL",
            "causality": "output",
            "variability": "discrete",
            "mimeType": HLI_TYPE,
        },
    )
    yield count + 1


def _one(out: ElementTree.Element, place: int, variable: Variable) -> None:
    told = {
        "name": variable.array or variable.name,
        "valueReference": str(place),
        "description": variable.about,
        "causality": variable.causality,
        **varies(variable),
    }
    if variable.unit and variable.kind == "Real":
        told["unit"] = variable.unit
    is_text = variable.kind == "String"
    if variable.causality != "output" and not is_text:
        told["start"] = start_of(variable)
    one = ElementTree.SubElement(out, KINDS[variable.kind], told)
    if is_text:
        ElementTree.SubElement(one, "Start", {"value": start_of(variable)})
    if variable.array:
        ElementTree.SubElement(one, "Dimension", {"start": str(ARRAY)})
