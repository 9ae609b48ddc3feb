// Conversations of a client that shares no code with ours: any WebSocket of the standard's, npm's ws or a browser's;
// FlatBuffers written and read by hand. Each throws where it goes otherwise than PROTOCOL.md says.
export const WINDOW = 256 << 10;
const ENVELOPE = 160;
const PAYLOAD = 4; // the version of batches
const client = { Open: 1, View: 2, Credit: 3 };
export const server = { Opened: 1, Batch: 2, Done: 3, Fault: 4 };

// Tables as objects of field numbers: a number is a byte, a bigint a uint64 (or, if small, a uint32), a string a string,
// an object a table.
export function encode(root) {
  const bytes = new Uint8Array(4096), at = new DataView(bytes.buffer);
  let end = 4;
  const put = (value) => {
    if (typeof value === 'string') {
      const start = (end + 3) & ~3, text = new TextEncoder().encode(value);
      at.setUint32(start, text.length, true);
      bytes.set(text, start + 4);
      end = start + 4 + text.length + 1;
      return start;
    }
    const slots = Math.max(-1, ...Object.keys(value).map(Number)) + 1, vtable = 4 + 2 * slots;
    const start = (end + vtable + 7) & ~7;
    at.setUint16(start - vtable, vtable, true);
    at.setUint16(start - vtable + 2, 8 + 8 * slots, true);
    at.setInt32(start, vtable, true);
    end = start + 8 + 8 * slots;
    for (const [slot, field] of Object.entries(value)) {
      const place = start + 8 + 8 * Number(slot);
      at.setUint16(start - vtable + 4 + 2 * Number(slot), place - start, true);
      if (typeof field === 'number') at.setUint8(place, field);
      else if (typeof field === 'bigint') at.setBigUint64(place, field, true);
      else at.setUint32(place, put(field) - place, true);
    }
    return start;
  };
  at.setUint32(0, put(root), true);
  return bytes.subarray(0, end);
}

class Table {
  constructor(view, at) {
    Object.assign(this, { view, at, vtable: at - view.getInt32(at, true) });
  }
  place(slot) {
    const entry = 4 + 2 * slot;
    const offset = entry < this.view.getUint16(this.vtable, true) ? this.view.getUint16(this.vtable + entry, true) : 0;
    return offset && this.at + offset;
  }
  number(slot, size) {
    const place = this.place(slot);
    if (!place) return 0;
    if (size === 8) return Number(this.view.getBigUint64(place, true));
    return size === 4 ? this.view.getUint32(place, true) : size === 2 ? this.view.getUint16(place, true) : this.view.getUint8(place);
  }
  target(slot) {
    const place = this.place(slot);
    return place + this.view.getUint32(place, true);
  }
  table(slot) {
    return new Table(this.view, this.target(slot));
  }
  length(slot) {
    return this.view.getUint32(this.target(slot), true);
  }
}

function decode(buffer) {
  const view = new DataView(buffer), root = new Table(view, view.getUint32(0, true));
  return { kind: root.number(0, 1), body: root.table(1) };
}

export function must(condition, what) {
  if (!condition) throw new Error(what);
}

// What there is to say, and what is said by the conversations below, to one server with a data set.
export function conversations(WebSocket, url, dataset) {
  const open = (name = dataset, credit = WINDOW, payload = PAYLOAD) =>
    encode({ 0: client.Open, 1: { 0: name, 1: 'talk.mjs', 2: BigInt(credit), 4: BigInt(payload) } });
  const view = (epoch = 1) => encode({ 0: client.View, 1: { 0: BigInt(epoch), 1: {} } });
  const credit = (size) => encode({ 0: client.Credit, 1: { 0: BigInt(size) } });

  // A WebSocket whose messages can be waited for one by one; nothing after the last.
  async function connect(protocols = ['intervale.v1']) {
    const ws = new WebSocket(url, protocols);
    ws.binaryType = 'arraybuffer';
    const messages = [];
    let wake = () => {};
    ws.onmessage = ({ data }) => {
      messages.push(data instanceof ArrayBuffer ? decode(data) : { kind: 'text' });
      wake();
    };
    const closed = new Promise((resolve) => {
      ws.onclose = ({ code }) => {
        messages.push(null);
        wake();
        resolve(code);
      };
    });
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
    await new Promise((resolve, reject) => {
      ws.onopen = resolve;
      ws.onerror = () => reject(new Error('no connection'));
    });
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
      await between(sequence);
      peer.ws.send(credit(cost));
      outstanding += cost;
    }
  }

  const all = {
    async theWholeStream() {
      const peer = await connect(['other.v9', 'intervale.v1']);
      must(peer.ws.protocol === 'intervale.v1', 'another subprotocol');
      must(peer.ws.extensions === '', 'an extension');
      peer.ws.send(open());
      peer.ws.send(view());
      const opened = await peer.expect(server.Opened), all = opened.table(0).number(8, 8);
      must(opened.number(5, 4) === PAYLOAD, 'batches of another version');
      const updates = await takeStream(peer);
      must(updates === all && all > 0, `${updates} of ${all} updates`);
      peer.ws.close(1000);
      must((await peer.closed) === 1000, 'another close code');
    },
    async noOtherSubprotocol() {
      const refused = await connect(['other.v9']).then(() => false, () => true);
      must(refused, 'accepted');
    },
    async closeCodes() {
      const ends = [['hello', 1003], [new Uint8Array(64).fill(255), 4400], [open('nowhere'), 4404], [view(), 4409], [open(dataset, 2 ** 40), 4413],
                    [open(dataset, WINDOW, 0), 4426], [open(dataset, WINDOW, PAYLOAD + 1), 4426], [new Uint8Array(65537), 4413]];
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
  return { all, open, view, connect, takeStream, Opened: server.Opened };
}

// Holds them one after the other; a line for each that goes wrong.
export async function hold(all) {
  const failures = [];
  for (const [name, conversation] of Object.entries(all)) {
    try {
      await conversation();
    } catch (error) {
      failures.push(`${name}: ${error.message}`);
    }
  }
  return failures;
}
