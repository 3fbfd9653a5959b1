"""modelDescription.xml, as FMI 2.0 has it (FMI 2.0.4, section 2.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from .variables import Variable

# by exponents of the base units, and the factor to them
UNITS: dict[str, dict[str, str]] = {
    "mm": {"m": "1", "factor": "0.001"},
    "mm/s": {"m": "1", "s": "-1", "factor": "0.001"},
    "mm/s2": {"m": "1", "s": "-2", "factor": "0.001"},
    "mm/s3": {"m": "1", "s": "-3", "factor": "0.001"},
    "rad": {"rad": "1"},
    "%": {"factor": "0.01"},
}


@dataclass(frozen=True)
class Model:
    """What describes one FMU."""

    name: str
    guid: str
    cycle_s: float
    program: str
    variables: Sequence[Variable]

    @property
    def identifier(self) -> str:
        return "hli_cosim"


def begun(
    model: Model, tool: str, words: dict[str, str], can: dict[str, str]
) -> ElementTree.Element:
    """What both versions of the standard begin with, up to the variables.

    ``words``: of the root; ``can``: of the element CoSimulation.
    """
    root = ElementTree.Element(
        "fmiModelDescription",
        {
            **words,
            "modelName": model.name,
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
            **can,
        },
    )
    _add_units(root, model.variables)
    log = ElementTree.SubElement(root, "LogCategories")
    ElementTree.SubElement(log, "Category", {"name": "logStatusError"})
    ElementTree.SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0", "stepSize": repr(model.cycle_s)},
    )
    return root


def written(root: ElementTree.Element) -> bytes:
    """The file's bytes."""
    ElementTree.indent(root)
    out: bytes = ElementTree.tostring(root, "utf-8", xml_declaration=True)
    return out


def description(model: Model, tool: str) -> bytes:
    """The file's bytes."""
    words = {"fmiVersion": "2.0", "guid": model.guid}
    can = {
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canGetAndSetFMUstate": "false",
        "canNotUseMemoryManagementFunctions": "true",
    }
    root = begun(model, tool, words, can)
    _variables(root, model.variables)
    _structure(root, model.variables)
    return written(root)


def _add_units(
    root: ElementTree.Element, variables: Sequence[Variable]
) -> None:
    used = dict.fromkeys(v.unit for v in variables if v.unit in UNITS)
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for name in used:
        unit = ElementTree.SubElement(units, "Unit", {"name": name})
        ElementTree.SubElement(unit, "BaseUnit", UNITS[name])


def _variables(
    root: ElementTree.Element, variables: Sequence[Variable]
) -> None:
    out = ElementTree.SubElement(root, "ModelVariables")
    for place, variable in enumerate(variables):
        scalar = ElementTree.SubElement(
            out,
            "ScalarVariable",
            {
                "name": variable.name,
                "valueReference": str(place),
                "description": variable.about,
                "causality": variable.causality,
                **varies(variable),
            },
        )
        ElementTree.SubElement(scalar, variable.kind, _declared(variable))


def varies(variable: Variable) -> dict[str, str]:
    if variable.causality == "parameter":
        return {"variability": "fixed", "initial": "exact"}
    variability = "continuous" if variable.kind == "Real" else "discrete"
    out = {"variability": variability}
    if variable.causality == "output":
        out["initial"] = "calculated"
    return out


def _declared(variable: Variable) -> dict[str, str]:
    out = {}
    if variable.unit in UNITS and variable.kind == "Real":
        out["unit"] = variable.unit
    if variable.causality != "output":
        out["start"] = start_of(variable)
    return out


def start_of(variable: Variable) -> str:
    """The start value in the words of the type."""
    if variable.kind == "String":
        return variable.text
    if variable.kind == "Boolean":
        return "true" if variable.start else "false"
    return repr(
        variable.start if variable.kind == "Real" else int(variable.start)
    )


def _structure(
    root: ElementTree.Element, variables: Sequence[Variable]
) -> None:
    """Outputs, and which are calculated at the initialization."""
    out = ElementTree.SubElement(root, "ModelStructure")
    places = [
        str(i)
        for i, variable in enumerate(variables, 1)
        if variable.causality == "output"
    ]
    for name in ("Outputs", "InitialUnknowns"):
        part = ElementTree.SubElement(out, name)
        for place in places:
            ElementTree.SubElement(part, "Unknown", {"index": place})
