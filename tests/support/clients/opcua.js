// A session of node-opcua: reads, writes, monitors; prints JSON.
const ua = require("node-opcua-client");
const CNC = "http://opcfoundation.org/UA/CNC";
const SYMBOLS = "urn:hli-cosim:symbols";
const CH = "HLI_Global_Variables.gpCh[0]^";

async function main() {
  const client = ua.OPCUAClient.create({
    endpointMustExist: false,
    connectionStrategy: { maxRetry: 1, initialDelay: 100 },
  });
  await client.connect(process.argv[2]);
  const found = {};
  const session = await client.createSession();
  const names = await session.readNamespaceArray();
  const cnc = names.indexOf(CNC);
  const own = names.indexOf(SYMBOLS);
  const value = async (nodeId) => (await session.read({ nodeId })).value.value;
  const channel = `ns=${cnc};s=CncInterface.CncChannelList.Channel1`;
  found.feed = await value(`${channel}.ActFeedrate`);
  found.status = await value(`${channel}.ActProgramStatus`);
  const position = await value(`${channel}.PosTcpBcsX`);
  found.position = { ...position };
  found.distance = await value(`ns=${own};s=${CH}.bahn_state.dist_prog_start`);
  found.gain = await value(`ns=${own};s=Slow.gain`);
  const lists = await session.browse(`ns=${cnc};s=CncInterface`);
  found.lists = lists.references.map((one) => one.browseName.name);
  const wish = (number) => ({
    nodeId: `ns=${own};s=Slow.gain`,
    attributeId: ua.AttributeIds.Value,
    value: { value: { dataType: "Double", value: number } },
  });
  found.anonymous = (await session.write(wish(9))).name;
  const user = { type: ua.UserTokenType.UserName, userName: "op" };
  const named = await client.createSession({ ...user, password: "secret" });
  found.named = (await named.write(wish(9.5))).name;
  found.written = await value(`ns=${own};s=Slow.gain`);
  const subscription = await session.createSubscription2({
    requestedPublishingInterval: 20,
    requestedMaxKeepAliveCount: 20,
    requestedLifetimeCount: 100,
    publishingEnabled: true,
  });
  found.told = await new Promise((resolve) => {
    subscription
      .monitor(
        { nodeId: `ns=${own};s=Slow.n`, attributeId: ua.AttributeIds.Value },
        { samplingInterval: 10, queueSize: 10 },
        ua.TimestampsToReturn.Both,
      )
      .then((item) => {
        const seen = [];
        item.on("changed", (data) => {
          seen.push(Number(data.value.value[1] ?? data.value.value));
          if (seen.length > 2) resolve(seen);
        });
      });
  });
  await subscription.terminate();
  await named.close();
  await session.close();
  await client.disconnect();
  console.log(JSON.stringify(found));
}

main().then(
  () => process.exit(0),
  (error) => {
    console.error(error);
    process.exit(1);
  },
);
