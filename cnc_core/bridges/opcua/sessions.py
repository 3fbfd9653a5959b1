"""Sessions of clients: who may write, and what the PLC has to be asked for."""

from __future__ import annotations

import hmac
from typing import Any

from asyncua import ua
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession

from ...observing.plc import RefusedError
from ..symbols.cell import GoneError, OwnedError, ServedCell
from .entries import SymbolEntry
from .space import Space


class Users:
    """Anonymous clients read; those with a name and password write, too."""

    def __init__(self, passwords: dict[str, str]) -> None:
        self._passwords = passwords

    def get_user(
        self,
        iserver: Any,
        username: str | None = None,
        password: str | None = None,
        certificate: Any = None,
    ) -> User | None:
        """None: refused."""
        if username is None:
            return User(role=UserRole.User)
        wanted = self._passwords.get(username)
        given = (password or "").encode()
        if wanted is None or not hmac.compare_digest(wanted.encode(), given):
            return None
        return User(role=UserRole.User, name=username)


class Session(InternalSession):  # type: ignore[misc]
    """Asks the PLC ahead of a read; gives writes to it."""

    iserver: CellServer

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        nodes = [r.NodeId for r in params.NodesToRead]
        await ask_plc(self.iserver.space, nodes)
        found: list[ua.DataValue] = await super().read(params)
        return found

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        nodes = [item.ItemToMonitor.NodeId for item in params.ItemsToCreate]
        await ask_plc(self.iserver.space, nodes)
        found: list[Any] = await super().create_monitored_items(params)
        paces = self.iserver.space.paces
        for item, result in zip(params.ItemsToCreate, found, strict=True):
            asked_ms = item.RequestedParameters.SamplingInterval
            if not asked_ms >= 0:  # as often as the subscription publishes
                asked_ms = result.RevisedSamplingInterval
            result.RevisedSamplingInterval = asked_ms
            node, pace = item.ItemToMonitor.NodeId, asked_ms / 1e3
            paces[node] = min(paces.get(node, pace), pace)
        return found

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        space = self.iserver.space
        may = self.user is not None and self.user.name is not None
        return [
            ua.StatusCode(await _written(space, value, may))
            for value in params.NodesToWrite
        ]


class CellServer(InternalServer):  # type: ignore[misc]
    """Gives clients sessions that know the cell."""

    space: Space

    def create_session(
        self, name: str, user: Any = None, external: bool = False
    ) -> InternalSession:
        """A session of a client."""
        return Session(
            self,
            self.aspace,
            self.subscription_service,
            name,
            user=user or User(role=UserRole.Anonymous),
            external=external,
        )


async def ask_plc(space: Space, nodes: list[ua.NodeId]) -> None:
    """Fetch the symbols of the PLC among these nodes, by one question."""
    found = [space.entries.get(node) for node in nodes]
    wanted = [
        entry
        for entry in found
        if isinstance(entry, SymbolEntry) and entry.place.of_plc
    ]
    if not wanted:
        return
    try:
        data = await space.cell.read([entry.place for entry in wanted])
    except (GoneError, RefusedError):
        for entry in wanted:
            entry.asked = None
        return
    for entry, value in zip(wanted, data, strict=True):
        entry.asked = value


async def _written(space: Space, wanted: ua.WriteValue, may: bool) -> int:
    """The status code of one write."""
    if wanted.AttributeId != ua.AttributeIds.Value:
        return int(ua.StatusCodes.BadNotWritable)
    entry = space.entries.get(wanted.NodeId)
    if entry is None:
        known = wanted.NodeId in space.aspace
        unknown = ua.StatusCodes.BadNodeIdUnknown
        return int(ua.StatusCodes.BadNotWritable if known else unknown)
    if not isinstance(entry, SymbolEntry):
        return int(ua.StatusCodes.BadNotWritable)
    if not may:
        return int(ua.StatusCodes.BadUserAccessDenied)
    variant = wanted.Value.Value
    data = None if variant is None else entry.bytes_of(variant)
    if wanted.IndexRange or data is None:
        return int(ua.StatusCodes.BadTypeMismatch)
    return await _assigned(space.cell, entry, data)


async def _assigned(cell: ServedCell, entry: SymbolEntry, data: bytes) -> int:
    try:
        await cell.write(entry.place, data)
    except OwnedError:
        return int(ua.StatusCodes.BadNotWritable)
    except GoneError:
        return int(ua.StatusCodes.BadNoCommunication)
    except RefusedError:
        return int(ua.StatusCodes.BadOutOfRange)
    return int(ua.StatusCodes.Good)
