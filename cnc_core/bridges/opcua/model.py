"""OPC 40502 as tables: types with their node ids, members, enumerations.

The ids, names and data types are those of the public specification 1.00.
"""

from __future__ import annotations

URI = "http://opcfoundation.org/UA/CNC"

# object type -> (id, id of the type above it; below 1000: of OPC UA itself)
OBJECT_TYPES: dict[str, tuple[int, int]] = {
    "CncComponentType": (1001, 58),
    "CncChannelType": (1002, 1001),
    "CncDriveType": (1003, 1001),
    "CncAxisType": (1004, 1003),
    "CncSpindleType": (1005, 1003),
    "CncAlarmType": (1006, 10523),
    "CncInterfaceType": (1007, 58),
    "CncAxisListType": (1008, 58),
    "CncSpindleListType": (1009, 58),
    "CncChannelListType": (1010, 58),
    "CncMessageType": (1011, 2041),
}
OWN_IDS = range(1001, 1012)  # of the model; all other ids are of OPC UA

POSITION = "CncPositionDataType"
POSITION_TYPE, POSITION_ENCODING, POSITION_VARIABLE = 3007, 5001, 2001
POSITION_MEMBERS = ("ActPos", "CmdPos", "RemDist")

ENUMERATIONS: dict[str, tuple[int, tuple[str, ...]]] = {
    "CncSpindleTurnDirection": (3001, ("None", "CW", "CCW")),
    "CncChannelProgramStatus": (
        3002,
        ("Stopped", "Running", "Waiting", "Interrupted", "Canceled"),
    ),
    "CncChannelStatus": (3003, ("Active", "Interrupted", "Reset")),
    "CncAxisStatus": (3004, ("InPosition", "Moving", "Parked")),
    "CncSpindleStatus": (
        3005,
        ("Stopped", "InTargetArea", "Accelerating", "Decelerating", "Parked"),
    ),
    "CncOperationMode": (3006, ("Manual", "MDA", "Automatic")),
}

# kind of a variable -> id of its type definition
ANALOG, ITEM, PROPERTY = 2368, 2365, 68
KINDS = {"analog": ANALOG, "item": ITEM, "property": PROPERTY}

# type -> member | data type ([] an array) | kind; ? optional
MEMBERS: dict[str, str] = {
    "CncInterfaceType": """
        CncTypeName | String | property ?
        Fix | String | property ?
        VendorName | String | property
        VendorRevision | String | property
        Version | String | property
    """,
    "CncChannelType": """
        ActFeedrate | Double | analog
        ActGFunctions | UInt32[] | item
        ActJogIncrement | Double | analog
        ActMainProgramFile | String | item
        ActMainProgramName | String | item
        ActMFunctions | UInt32[] | item
        ActModalOffsetFunction | UInt32 | item
        ActOperationMode | CncOperationMode | item
        ActOverride | Double | analog
        ActProgramBlock | String[] | item
        ActProgramFile | String | item
        ActProgramLine | String | item ?
        ActProgramName | String | item
        ActProgramStatus | CncChannelProgramStatus | item
        ActStatus | CncChannelStatus | item
        BlockMode | Boolean | item
        CmdFeedrate | Double | analog
        CmdOperationMode | CncOperationMode | item
        CmdOverride | Double | analog
        DryRunFeed | Double | analog
        FeedHold | Boolean | item
        Id | UInt32 | property
        PosTcpBcsA | CncPositionDataType | position
        PosTcpBcsB | CncPositionDataType | position
        PosTcpBcsC | CncPositionDataType | position
        PosTcpBcsX | CncPositionDataType | position
        PosTcpBcsY | CncPositionDataType | position
        PosTcpBcsZ | CncPositionDataType | position
        PosTcpWcsA | CncPositionDataType | position
        PosTcpWcsB | CncPositionDataType | position
        PosTcpWcsC | CncPositionDataType | position
        PosTcpWcsX | CncPositionDataType | position
        PosTcpWcsY | CncPositionDataType | position
        PosTcpWcsZ | CncPositionDataType | position
        ToolId | UInt32 | item
    """,
    "CncDriveType": """
        ActChannel | NodeId | item
        ActLoad | Double | analog
        ActPower | Double | analog
        ActTorque | Double | analog
        CmdTorque | Double | analog
        IsInactive | Boolean | item
        IsVirtual | Boolean | item
    """,
    "CncAxisType": """
        ActStatus | CncAxisStatus | item
        IsReferenced | Boolean | item
        IsRotational | Boolean | item
        PosDirect | CncPositionDataType | position
        PosIndirect | CncPositionDataType | position
        ZeroOffset | Double | analog
    """,
    "CncSpindleType": """
        ActGear | UInt32 | item
        ActOverride | Double | analog
        ActSpeed | Double | analog
        ActStatus | CncSpindleStatus | item
        ActTurnDirection | CncSpindleTurnDirection | item
        AnglePos | CncPositionDataType | position
        CmdGear | UInt32 | item
        CmdOverride | Double | analog
        CmdSpeed | Double | analog
    """,
    "CncAlarmType": """
        AlarmIdentifier | String | property
        AuxParameters | String[] | property ?
        HelpSource | String | property ?
    """,
}


def members_of(type_name: str) -> list[tuple[str, str, str, bool]]:
    """(name, data type, kind, optional) of a type's own members."""
    found = []
    for line in MEMBERS.get(type_name, "").strip().splitlines():
        name, data_type, kind = (part.strip() for part in line.split("|"))
        optional = kind.endswith("?")
        found.append((name, data_type, kind.rstrip(" ?"), optional))
    return found


def all_members_of(type_name: str) -> list[tuple[str, str, str, bool]]:
    """The same with those of the types above it."""
    _, above = OBJECT_TYPES[type_name]
    names = {number: name for name, (number, _) in OBJECT_TYPES.items()}
    inherited = all_members_of(names[above]) if above in names else []
    return inherited + members_of(type_name)
