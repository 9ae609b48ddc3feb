// A client that shares no code with ours: npm's ws for the line, FlatBuffers written and read by hand.
// talk.mjs PORT DATASET WS, where WS is ws's index.js: status 1 and a line for each conversation that goes otherwise than PROTOCOL.md says.
const [port, dataset, library] = process.argv.slice(2);
const { default: WebSocket } = await import(library);
const WINDOW = 256 << 10, ENVELOPE = 160;
const client = { Open: 1, View: 2, Credit: 3 }, server = { Opened: 1, Batch: 2, Done: 3, Fault: 4 };

// Tables as objects of field numbers: a number is a byte, a bigint a uint64, a string a string, an object a table.
function encode(root) {
  const bytes = Buffer.alloc(4096);
  let end = 4;
  const put = (value) => {
    if (typeof value === 'string') {
      const at = (end + 3) & ~3;
      bytes.writeUInt32LE(Buffer.byteLength(value), at);
      end = at + 4 + bytes.write(value, at + 4) + 1;
      return at;
    }
    const slots = Math.max(-1, ...Object.keys(value).map(Number)) + 1, vtable = 4 + 2 * slots;
    const at = (end + vtable + 7) & ~7;
    bytes.writeUInt16LE(vtable, at - vtable);
    bytes.writeUInt16LE(8 + 8 * slots, at - vtable + 2);
    bytes.writeInt32LE(vtable, at);
    end = at + 8 + 8 * slots;
    for (const [slot, field] of Object.entries(value)) {
      const place = at + 8 + 8 * Number(slot);
      bytes.writeUInt16LE(place - at, at - vtable + 4 + 2 * Number(slot));
      if (typeof field === 'number') bytes.writeUInt8(field, place);
      else if (typeof field === 'bigint') bytes.writeBigUInt64LE(field, place);
      else bytes.writeUInt32LE(put(field) - place, place);
    }
    return at;
  };
  bytes.writeUInt32LE(put(root), 0);
  return bytes.subarray(0, end);
}

const open = (name = dataset, credit = WINDOW) => encode({ 0: client.Open, 1: { 0: name, 1: 'talk.mjs', 2: BigInt(credit) } });
const view = (epoch = 1) => encode({ 0: client.View, 1: { 0: BigInt(epoch), 1: {} } });
const credit = (size) => encode({ 0: client.Credit, 1: { 0: BigInt(size) } });

class Table {
  constructor(bytes, at) {
    Object.assign(this, { bytes, at, vtable: at - bytes.readInt32LE(at) });
  }
  place(slot) {
    const entry = 4 + 2 * slot;
    const offset = entry < this.bytes.readUInt16LE(this.vtable) ? this.bytes.readUInt16LE(this.vtable + entry) : 0;
    return offset && this.at + offset;
  }
  number(slot, size) {
    const place = this.place(slot);
    return place ? (size === 8 ? Number(this.bytes.readBigUInt64LE(place)) : this.bytes.readUIntLE(place, size)) : 0;
  }
  target(slot) {
    const place = this.place(slot);
    return place + this.bytes.readUInt32LE(place);
  }
  table(slot) {
    return new Table(this.bytes, this.target(slot));
  }
  length(slot) {
    return this.bytes.readUInt32LE(this.target(slot));
  }
}

function decode(bytes) {
  const root = new Table(bytes, bytes.readUInt32LE(0));
  return { kind: root.number(0, 1), body: root.table(1) };
}

function must(condition, what) {
  if (!condition) throw new Error(what);
}

// A WebSocket whose messages can be waited for one by one; nothing after the last.
async function connect(protocols = ['intervale.v1']) {
  const ws = new WebSocket(`ws://127.0.0.1:${port}/v1/stream`, protocols, { perMessageDeflate: false });
  const messages = [];
  let wake = () => {};
  ws.on('message', (data, isBinary) => {
    must(isBinary, 'text from the server');
    messages.push(decode(data));
    wake();
  });
  const closed = new Promise((resolve) => ws.on('close', (code) => {
    messages.push(null);
    wake();
    resolve(code);
  }));
  const receive = async () => {
    while (messages.length === 0) await new Promise((resolve) => (wake = resolve));
    return messages[0] === null ? null : messages.shift();
  };
  const expect = async (kind) => {
    const message = await receive();
    must(message?.kind === kind, `${message?.kind} instead of ${kind}`);
    return message.body;
  };
  const expectEnd = async (code) => {
    const fault = await expect(server.Fault);
    must(fault.number(0, 2) === code, `a fault of code ${fault.number(0, 2)} instead of ${code}`);
    must((await receive()) === null, 'a message after the fault');
    const got = await closed;
    must(got === code, `closed with ${got} instead of ${code}`);
  };
  await new Promise((resolve, reject) => ws.on('open', resolve).on('error', reject));
  return { ws, receive, expect, expectEnd, closed };
}

async function takeStream(peer, between = async () => {}) {
  let updates = 0, outstanding = WINDOW;
  for (let sequence = 0; ; ++sequence) {
    const { kind, body } = (await peer.receive()) ?? {};
    if (kind === server.Done) {
      must(body.number(1, 8) === updates, `Done says ${body.number(1, 8)} updates, and ${updates} came`);
      return updates;
    }
    must(kind === server.Batch, `${kind} in a stream`);
    must(body.number(1, 8) === sequence, 'a batch out of sequence');
    updates += body.number(2, 4);
    const cost = body.length(4) + ENVELOPE;
    outstanding -= cost;
    must(outstanding >= 0, 'more than was granted');
    await between(peer, sequence);
    peer.ws.send(credit(cost));
    outstanding += cost;
  }
}

const conversations = {
  async theWholeStream() {
    const peer = await connect(['other.v9', 'intervale.v1']);
    must(peer.ws.protocol === 'intervale.v1', 'another subprotocol');
    peer.ws.send(open());
    peer.ws.send(view());
    const opened = await peer.expect(server.Opened), all = opened.table(0).number(8, 8);
    const updates = await takeStream(peer);
    must(updates === all && all > 0, `${updates} of ${all} updates`);
    peer.ws.close(1000);
    must((await peer.closed) === 1000, 'another close code');
  },
  async fragmentsAndPings() {
    const peer = await connect();
    const ping = () => new Promise((resolve) => (peer.ws.once('pong', resolve), peer.ws.ping()));
    const bytes = open();
    for (let i = 0; i < bytes.length; ++i) {
      peer.ws.send(bytes.subarray(i, i + 1), { fin: i + 1 === bytes.length });
      if (i % 8 === 0) await ping();
    }
    peer.ws.send(view());
    await peer.expect(server.Opened);
    must((await takeStream(peer, async (_, sequence) => sequence < 3 && ping())) > 0, 'no updates');
    peer.ws.terminate();
  },
  async closeCodes() {
    const ends = [['hello', 1003], [Buffer.alloc(64, 255), 4400], [open('nowhere'), 4404], [view(), 4409], [open(dataset, 2 ** 40), 4413], [Buffer.alloc(65537), 4413]];
    for (const [message, code] of ends) {
      const peer = await connect();
      peer.ws.send(message);
      await peer.expectEnd(code);
    }
  },
  async closeInEveryState() {
    const states = [[], [open()], [open(), view()], [open(), view(), credit(1000)]];
    for (const messages of states) {
      for (const answers of messages.length > 1 ? [0, 1, 2] : [0, messages.length]) {
        const peer = await connect();
        for (const message of messages) peer.ws.send(message);
        for (let i = 0; i < answers; ++i) must(await peer.receive(), 'closed');
        peer.ws.close(1000);
        must((await peer.closed) === 1000, 'another close code');
      }
    }
  },
};

let failures = 0;
for (const [name, conversation] of Object.entries(conversations)) {
  try {
    await conversation();
  } catch (error) {
    console.log(`${name}: ${error.message}`);
    ++failures;
  }
}
process.exit(failures > 0 ? 1 : 0);
