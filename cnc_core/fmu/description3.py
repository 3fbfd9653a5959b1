"""modelDescription.xml, as FMI 3.0 has it (FMI 3.0, section 2.4)."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree

from .description import Model, add_units, start_of, varies
from .variables import ELEMENTS_SHOWN, MEMBERS, Variable

KINDS = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
HLI_TYPE = "application/octet-stream"


def description3(model: Model, tool: str) -> bytes:
    """The file's bytes."""
    root = ElementTree.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0",
            "modelName": model.name,
            "instantiationToken": model.guid,
            "description": f"CNC and PLC with the program {model.program}",
            "generationTool": tool,
            "variableNamingConvention": "structured",
        },
    )
    ElementTree.SubElement(
        root,
        "CoSimulation",
        {
            "modelIdentifier": model.identifier,
            "needsExecutionTool": "true",
            "canHandleVariableCommunicationStepSize": "true",
            "canGetAndSetFMUState": "false",
        },
    )
    add_units(root, model.variables)
    log = ElementTree.SubElement(root, "LogCategories")
    ElementTree.SubElement(log, "Category", {"name": "logStatusError"})
    ElementTree.SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0", "stepSize": repr(model.cycle_s)},
    )
    declared = ElementTree.SubElement(root, "ModelVariables")
    places = list(_declare(declared, model))
    structure = ElementTree.SubElement(root, "ModelStructure")
    for name in ("Output", "InitialUnknown"):
        for place in places:
            ElementTree.SubElement(
                structure, name, {"valueReference": str(place)}
            )
    ElementTree.indent(root)
    out: bytes = ElementTree.tostring(root, "utf-8", xml_declaration=True)
    return out


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
    for place, variable in enumerate(model.variables):
        element = variable.name.startswith("ahead")
        if element and not variable.name.startswith("ahead0."):
            continue  # of the array that has begun
        _one(out, place, variable, ELEMENTS_SHOWN if element else 0)
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


def _one(
    out: ElementTree.Element, place: int, variable: Variable, size: int
) -> None:
    told = {
        "name": variable.name.replace("ahead0.", "ahead.")
        if size
        else variable.name,
        "valueReference": str(place),
        "description": variable.about,
        "causality": variable.causality,
        **varies(variable),
    }
    if variable.unit and variable.kind == "Real":
        told["unit"] = variable.unit
    if variable.causality != "output":
        told["start"] = start_of(variable)
    one = ElementTree.SubElement(out, KINDS[variable.kind], told)
    if size:
        ElementTree.SubElement(one, "Dimension", {"start": str(size)})


def arrays() -> tuple[int, int]:
    """How many arrays there are, and the size of each."""
    return len(MEMBERS), ELEMENTS_SHOWN
