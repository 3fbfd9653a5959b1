"""Secure endpoints of OPC UA: policies, certificates, users."""

from __future__ import annotations

import asyncio
import datetime
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from support.bridged import Bridged

opcua_client: Any = pytest.importorskip("support.opcua_client")
asyncua, ua = opcua_client.asyncua, opcua_client.ua
session = opcua_client.session
POLICIES = (
    "Basic256Sha256,Sign",
    "Basic256Sha256,SignAndEncrypt",
    "Aes128Sha256RsaOaep,SignAndEncrypt",
    "Aes256Sha256RsaPss,SignAndEncrypt",
)
pytestmark = pytest.mark.ci
TITLE = "MAIN.title"
GAIN = "Slow.gain"


def written(folder: Path) -> tuple[Path, Path]:
    """A certificate that signs itself, and its key."""
    from cryptography import x509  # noqa: PLC0415
    from cryptography.hazmat.primitives import (  # noqa: PLC0415
        hashes,
        serialization,
    )
    from cryptography.hazmat.primitives.asymmetric import rsa  # noqa: PLC0415

    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    common = x509.NameAttribute(x509.NameOID.COMMON_NAME, "hli-cosim tests")
    name = x509.Name([common])
    now = datetime.datetime.now(datetime.UTC)
    uri = x509.UniformResourceIdentifier("urn:hli-cosim:tests")
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(7)
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([uri]), critical=False)
        .sign(key, hashes.SHA256())
    )
    public, private = folder / "cert.pem", folder / "key.pem"
    pem = serialization.Encoding.PEM
    public.write_bytes(certificate.public_bytes(pem))
    private.write_bytes(
        key.private_bytes(
            pem,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return public, private


@pytest.fixture(scope="module")
def secure(
    bridged: Bridged, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Any]:
    """A server with a certificate; ``pair`` has the words for a client."""
    from cnc_core.bridges.opcua.server import Door  # noqa: PLC0415
    from support.opcua_served import Served  # noqa: PLC0415

    public, private = written(tmp_path_factory.mktemp("keys"))
    door = Door(
        port=0,
        passwords={"op": "secret"},
        certificate=public,
        key=private,
    )
    found = Served(bridged, door)
    found.pair = f"{public},{private}"
    yield found
    found.close()


def policy_of(endpoint: Any) -> str:
    """``Aes128_Sha256_RsaOaep`` as asyncua writes it."""
    name: str = endpoint.SecurityPolicyUri.rpartition("#")[2]
    return name.replace("_", "")


@pytest.mark.ci
def test_the_policies_are_offered(secure: Any) -> None:
    """Each as an endpoint, beside the one without security."""

    async def look() -> set[tuple[str, str]]:
        client = asyncua.Client(secure.url)
        return {
            (policy_of(one), one.SecurityMode.name)
            for one in await client.connect_and_get_server_endpoints()
        }

    wanted = {tuple(policy.split(",")) for policy in POLICIES}
    assert asyncio.run(look()) == {*wanted, ("None", "None_")}


@pytest.mark.ci
@pytest.mark.parametrize("policy", POLICIES)
def test_a_client_reads_by_a_policy(secure: Any, policy: str) -> None:
    """Anonymous: it reads and does not write."""

    async def look() -> tuple[str, str]:
        words = f"{policy},{secure.pair}"
        async with session(secure.url, security=words) as one:
            title = await one.symbol(TITLE).read_value()
            with pytest.raises(ua.UaStatusCodeError) as refused:
                await one.symbol(GAIN).write_value(1.0)
            code = refused.value.code
            return title, ua.status_codes.get_name_and_doc(code)[0]

    assert asyncio.run(look()) == ("spindle", "BadUserAccessDenied")


def test_a_user_writes_over_an_encrypted_connection(secure: Any) -> None:
    """With the password; a wrong one is refused."""

    async def look() -> None:
        words = f"{POLICIES[1]},{secure.pair}"
        async with session(secure.url, "op", words) as one:
            await one.symbol(GAIN).write_value(8.25)
        client = asyncua.Client(secure.url)
        await client.set_security_string(words)
        client.set_user("op")
        client.set_password("guess")
        with pytest.raises(ua.UaStatusCodeError):
            async with client:
                pass

    asyncio.run(look())
    assert secure.task.gain == 8.25
