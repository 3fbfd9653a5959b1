"""TwinCAT's files and PLCopen XML give the same program as plain text."""

from __future__ import annotations

from pathlib import Path

from plc_client.st import build, sources_of
from plc_client.st.build import check
from plc_client.st.errors import REFUSED
from plc_client.st.machine.loader import StProgram

HEAD = (
    '<?xml version="1.0" encoding="utf-8"?>\n<TcPlcObject Version="1.1.0.1">\n'
)
VALVE = """  <POU Name="FB_Valve" Id="{1}">
    <Declaration><![CDATA[FUNCTION_BLOCK FB_Valve IMPLEMENTS I_Valve
VAR_INPUT
	bIn : BOOL;
END_VAR
VAR
	_open : BOOL;
END_VAR]]></Declaration>
    <Implementation><ST><![CDATA[IF bIn AND NOT _open THEN
	Count();
END_IF
_open := bIn;]]></ST></Implementation>
    <Action Name="Count" Id="{2}">
      <Implementation><ST><![CDATA[GVL.n := GVL.n + 1;]]></ST></Implementation></Action>
    <Property Name="IsOpen" Id="{3}"><Declaration><![CDATA[PROPERTY IsOpen : BOOL]]></Declaration>
      <Get Name="Get"><Declaration><![CDATA[]]></Declaration>
        <Implementation><ST><![CDATA[IsOpen := _open;]]></ST></Implementation></Get>
    </Property>
  </POU>
"""
INTERFACE = """  <Itf Name="I_Valve" Id="{1}">
    <Declaration><![CDATA[INTERFACE I_Valve]]></Declaration>
    <Property Name="IsOpen"><Declaration><![CDATA[PROPERTY IsOpen : BOOL]]></Declaration>
      <Get Name="Get"><Declaration><![CDATA[]]></Declaration></Get></Property>
  </Itf>
"""
GLOBALS = """  <GVL Name="GVL" Id="{1}"><Declaration><![CDATA[{attribute 'qualified_only'}
VAR_GLOBAL
	n : INT := 40;
END_VAR]]></Declaration></GVL>
"""
MAIN = """  <POU Name="MAIN" Id="{1}"><Declaration><![CDATA[PROGRAM MAIN
VAR
	fb : FB_Valve; itf : I_Valve; ok : BOOL; e : E_Mode := E_Mode.Auto;
END_VAR]]></Declaration>
    <Implementation><ST><![CDATA[fb(bIn := TRUE);
itf := fb;
ok := itf.IsOpen;]]></ST></Implementation></POU>
"""
MODE = """  <DUT Name="E_Mode" Id="{1}"><Declaration><![CDATA[{attribute 'qualified_only'}
TYPE E_Mode : (Manual, Auto) UINT; END_TYPE]]></Declaration></DUT>
"""
FILES = {
    "FB_Valve.TcPOU": VALVE,
    "I_Valve.TcIO": INTERFACE,
    "GVL.TcGVL": GLOBALS,
    "MAIN.TcPOU": MAIN,
    "E_Mode.TcDUT": MODE,
}
PROJECT = '<?xml version="1.0" encoding="utf-8"?>\n<Project><ItemGroup>{}</ItemGroup></Project>\n'
PLCOPEN = """<?xml version="1.0" encoding="utf-8"?>
<project xmlns="http://www.plcopen.org/xml/tc6_0200"><types><dataTypes/><pous>
<pou name="MAIN" pouType="program"><interface><localVars>
<variable name="x"><type><INT/></type>
<initialValue><simpleValue value="3"/></initialValue></variable>
</localVars></interface><body><ST><xhtml xmlns="http://www.w3.org/1999/xhtml">x := x + 1;
x := nowhere_or(x);</xhtml></ST></body></pou>
</pous></types></project>
"""


def write(folder: Path) -> Path:
    """A project of TwinCAT objects."""
    (folder / "POUs").mkdir()
    items = []
    for name, content in FILES.items():
        path = folder / "POUs" / name
        path.write_text(f"{HEAD}{content}</TcPlcObject>\n")
        items.append(f'<Compile Include="POUs\\{name}" />')
    project = folder / "Untitled1.plcproj"
    project.write_text(PROJECT.format("".join(items)))
    return project


def test_project_runs_with_methods_properties_and_actions(
    tmp_path: Path,
) -> None:
    """The .plcproj and its folder give the same running program."""
    project = write(tmp_path)
    for path in (project, tmp_path):
        program = StProgram(build(sources_of([path])))
        program.start()
        program.run(program.entry("MAIN"), 0)
        assert program["MAIN"].ok is True
        assert program["MAIN"].e == 1
        assert program["GVL"].n == 41


def test_errors_stand_at_the_line_of_the_xml(tmp_path: Path) -> None:
    """The line is the one of the file, not of the CDATA section."""
    project = write(tmp_path)
    path = tmp_path / "POUs" / "MAIN.TcPOU"
    path.write_text(path.read_text().replace("itf := fb", "itf := fx"))
    found = check(sources_of([project])).log.errors
    lines = path.read_text().splitlines()
    assert len(found) == 1
    assert "itf := fx" in lines[found[0].line - 1]


def test_plcopen_bodies_are_read_with_their_lines() -> None:
    """The second line of the body holds the error."""
    found = check({"project.xml": PLCOPEN}).log.errors
    assert [problem.line for problem in found] == [7]
    good = PLCOPEN.replace("nowhere_or(x)", "x * 2")
    program = StProgram(build({"project.xml": good}))
    program.start()
    program.run(program.entry("MAIN"), 0)
    assert program["MAIN"].x == 8


def test_accessor_with_access_and_a_body_in_another_language() -> None:
    """PROTECTED of a SET is taken; a ladder body is refused with its line."""
    pou = """<POU Name="FB" Id="{1}">
<Declaration><![CDATA[FUNCTION_BLOCK FB
VAR n : INT; END_VAR]]></Declaration>
<Implementation><ST><![CDATA[P := 2;]]></ST></Implementation>
<Property Name="P"><Declaration><![CDATA[PROPERTY P : INT]]></Declaration>
<Set Name="Set"><Declaration><![CDATA[PROTECTED
VAR
END_VAR
]]></Declaration><Implementation><ST><![CDATA[n := P;]]></ST></Implementation></Set>
</Property>LADDER</POU>
"""
    text = f"{HEAD}{pou}</TcPlcObject>"
    assert not check({"FB.TcPOU": text.replace("LADDER", "")}).log.errors
    ladder = """
<Method Name="M"><Declaration><![CDATA[METHOD M]]></Declaration>
<Implementation><NWL></NWL></Implementation></Method>
"""
    (found,) = check({"FB.TcPOU": text.replace("LADDER", ladder)}).log.errors
    assert (found.code, found.construct) == (REFUSED, "a body in NWL")
    assert found.line == 14


def test_export_of_codesys_2() -> None:
    """Lists of libraries are left out; a body in FBD is refused by name and line."""
    text = """(* @PATH := '' *)
FUNCTION_BLOCK FB_Two
VAR n : INT; END_VAR
(* @END_DECLARATION := '0' *)
n := n + 1;
END_FUNCTION_BLOCK
LIBRARY
Standard.lib 4.10.05 11:14:46
NumOfPOUs: 1
CONCAT: 0
END_LIBRARY
"""
    found = check({"two.EXP": text})
    assert (found.log.errors, found.pous) == ([], 1)
    foreign = text.replace("n := n + 1;", "_FBD_BODY\n_NETWORKS : 1")
    (problem,) = check({"two.EXP": foreign}).log.errors
    assert (problem.code, problem.construct) == (REFUSED, "a body in FBD")
    assert problem.line == 5


TAKES_LIBRARIES = """<?xml version="1.0" encoding="utf-8"?>
<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003">
<ItemGroup><Compile Include="MAIN.TcPOU"/></ItemGroup>
<ItemGroup><PlaceholderReference Include="Tc2_Standard"/>
<PlaceholderReference Include="MyLib"/></ItemGroup></Project>
"""
USES_LIBRARIES = """<POU Name="MAIN" Id="{1}"><Declaration><![CDATA[PROGRAM MAIN
VAR axis : AXIS_REF; timer : TON; other : FB_OfMyLib; x : INT; END_VAR]]></Declaration>
<Implementation><ST><![CDATA[axis.ReadStatus();
x := other.value;
x := 'text';]]></ST></Implementation></POU>
"""


def test_names_of_missing_libraries_are_refused(tmp_path: Path) -> None:
    """Once each, by name; what the project itself does wrong stays an error."""
    (tmp_path / "P.plcproj").write_text(TAKES_LIBRARIES)
    pou = tmp_path / "MAIN.TcPOU"
    pou.write_text(f"{HEAD}{USES_LIBRARIES}</TcPlcObject>")
    found = check(sources_of([tmp_path])).as_json()
    names = [entry["construct"] for entry in found["refused"]]
    assert names == ["AXIS_REF", "FB_OfMyLib"]
    assert "MyLib" in found["errors"][1]["text"]
    assert [e["line"] for e in found["errors"]] == [4, 4, 7]
    alone = check(sources_of([pou])).as_json()
    assert [e["construct"] for e in alone["refused"]] == ["AXIS_REF"]
    assert "FB_OfMyLib is unknown" in alone["errors"][1]["text"]
