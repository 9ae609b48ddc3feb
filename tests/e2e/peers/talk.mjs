// npm's ws in conversation with a server. talk.mjs PORT DATASET WS, where WS is ws's index.js: status 1 and a line for
// each that goes otherwise than PROTOCOL.md says.
import { conversations, hold, must } from './conversations.mjs';

const [port, dataset, library] = process.argv.slice(2);
const { default: WebSocket } = await import(library);
const { all, open, view, connect, takeStream, Opened } = conversations(WebSocket, `ws://127.0.0.1:${port}/v1/stream`, dataset);

// What a browser's WebSocket has no words for.
all.fragmentsAndPings = async () => {
  const peer = await connect();
  const ping = () => new Promise((resolve) => (peer.ws.once('pong', resolve), peer.ws.ping()));
  const bytes = open();
  for (let i = 0; i < bytes.length; ++i) {
    peer.ws.send(bytes.subarray(i, i + 1), { fin: i + 1 === bytes.length });
    if (i % 8 === 0) await ping();
  }
  peer.ws.send(view());
  await peer.expect(Opened);
  must((await takeStream(peer, async (sequence) => sequence < 3 && ping())) > 0, 'no updates');
  peer.ws.terminate();
};

const failures = await hold(all);
for (const line of failures) console.log(line);
process.exit(failures.length > 0 ? 1 : 0);
