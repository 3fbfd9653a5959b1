// A session of ads-client: finds, reads, writes, subscribes; prints JSON.
const { Client } = require("ads-client");
const CH = "HLI_Global_Variables.gpCh[0]^";

async function main() {
  const client = new Client({
    routerAddress: process.argv[2],
    targetAmsNetId: "127.0.0.1.1.1",
    targetAdsPort: 851,
    hideConsoleWarnings: true,
  });
  const found = {};
  found.connected = (await client.connect()).connected;
  found.state = (await client.readState()).adsStateStr;
  found.system = (await client.readTcSystemState()).adsStateStr;
  found.device = (await client.readDeviceInfo()).deviceName;
  const value = async (path) => (await client.readValue(path)).value;
  found.feed = await value(`${CH}.bahn_state.active_feed_r`);
  found.head = await value(`${CH}.head`);
  found.coord = (await value(`${CH}.bahn_state`)).coord_r[0];
  found.pair = await value("MAIN.pair");
  found.gain = await value("Slow.gain");
  const unit = `${CH}.bahn_mc_control.override`;
  await client.writeValue(unit, { ...(await value(unit)), command_w: 810 });
  found.override = await value(unit);
  await client.writeValue("MAIN.pair", { a: 5, b: [1, 2, 3.5] });
  found.written = await value("MAIN.pair");
  try {
    await client.writeValue(`${CH}.bahn_state.active_feed_r`, 1);
  } catch (error) {
    found.refused = error.adsError.errorCode;
  }
  found.symbols = Object.keys(await client.getSymbols()).length;
  found.types = Object.keys(await client.getDataTypes()).length;
  const handle = await client.createVariableHandle("Slow.gain");
  found.handle = (await client.readRawByHandle(handle)).readDoubleLE(0);
  await client.deleteVariableHandle(handle);
  found.told = await new Promise((resolve) => {
    client.subscribe({
      target: `${CH}.bahn_state.active_feed_r`,
      cycleTime: 1,
      callback: (data) => resolve(data.value),
    });
  });
  await client.disconnect();
  console.log(JSON.stringify(found));
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
