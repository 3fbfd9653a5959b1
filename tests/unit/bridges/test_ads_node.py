"""The ADS server with the client ads-client of npm, under node."""

from __future__ import annotations

import pytest

from support import clients
from support.bridged import ADS_HOST, Bridged


@pytest.mark.ci
def test_a_session_of_ads_client(bridged: Bridged) -> None:
    """It connects without a router of its own, decodes structures by the types
    that the server tells, writes, subscribes and leaves.
    """
    bridged.channel.bahn_state.active_feed_r = 4321
    bridged.channel.bahn_state.coord_r[0].act_position_r = -15
    found = clients.run("ads-client", "ads.js", ADS_HOST)
    assert found["connected"] is True
    assert (found["state"], found["system"]) == ("Run", "Run")
    assert found["device"] == "hli-cosim PLC"
    assert found["feed"] == found["told"] == 4321
    assert found["head"]["plc_present_w"] is True
    assert found["coord"]["act_position_r"] == -15
    assert found["coord"]["hb_display_r"]["tipp_geschw"] == 0
    assert found["pair"] == {"a": 0, "b": [0, 0, 0]}
    assert found["override"]["command_w"] == 810
    assert found["written"] == {"a": 5, "b": [1, 2, 3.5]}
    assert found["gain"] == found["handle"] == 2.5
    assert found["refused"] == 0x704
    assert found["symbols"] > 1000
    assert found["types"] > 80
