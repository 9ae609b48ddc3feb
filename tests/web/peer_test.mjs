// The protocol with Chromium's WebSocket, without our client: the conversations of tests/e2e/peers, and the close
// codes.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { kBuckyball, killServers, launch, makeData, serve } from './support.mjs';

const kConversations = fileURLToPath(new URL('../e2e/peers/conversations.mjs', import.meta.url));
let browser, data;
before(async () => {
  data = makeData(kBuckyball);
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers();
});

// Opens a page of the server that can import conversations.mjs.
async function visit(server) {
  const page = await browser.newPage();
  await page.route('**/conversations.mjs', (route) => route.fulfill({ path: kConversations, contentType: 'text/javascript' }));
  await page.goto(server.url);
  return page;
}

test('Chromium holds every conversation', async () => {
  const server = await serve(data);
  const page = await visit(server);
  const failures = await page.evaluate(async (dataset) => {
    const { conversations, hold } = await import('/conversations.mjs');
    return hold(conversations(WebSocket, `ws://${location.host}/v1/stream`, dataset).all);
  }, kBuckyball.name);
  assert.deepEqual(failures, []);
});

test('a close code tells Chromium whether a token is required or not sufficient', async () => {
  const tokens = join(data, 'tokens');
  writeFileSync(tokens, 'letmein\nelsewhere other*\n');
  const server = await serve(data, 0, '--tokens', tokens);
  const page = await visit(server);
  const codes = await page.evaluate(async (dataset) => {
    const { conversations } = await import('/conversations.mjs');
    const { open, connect } = conversations(WebSocket, `ws://${location.host}/v1/stream`, dataset);
    const received = [];
    for (const token of ['', 'wrong', 'elsewhere', 'letmein']) {
      const peer = await connect(token === '' ? ['intervale.v1'] : ['intervale.v1', `intervale.token.${btoa(token).replace(/=+$/, '')}`]);
      peer.ws.send(open());
      const { kind, body } = await peer.receive();
      received.push(kind === 4 ? [body.number(0, 2), await peer.closed] : kind);
      peer.ws.close();
    }
    return received;
  }, kBuckyball.name);
  assert.deepEqual(codes, [[4401, 4401], [4401, 4401], [4403, 4403], 1]);
});

test('a close code tells Chromium that the handshake timed out', async () => {
  const server = await serve(data, 0, '--handshake-time', '0.5');
  const page = await visit(server);
  const code = await page.evaluate(async () => {
    const { conversations } = await import('/conversations.mjs');
    const peer = await conversations(WebSocket, `ws://${location.host}/v1/stream`, '').connect();
    return peer.closed;
  });
  assert.equal(code, 4408);
});

test('a close code tells Chromium that the server shuts down', async () => {
  const server = await serve(data);
  const page = await visit(server);
  const code = page.evaluate(async (dataset) => {
    const { conversations } = await import('/conversations.mjs');
    const { open, connect } = conversations(WebSocket, `ws://${location.host}/v1/stream`, dataset);
    const peer = await connect();
    peer.ws.send(open());
    await peer.receive();
    window.opened = true;
    return peer.closed;
  }, kBuckyball.name);
  await page.waitForFunction(() => window.opened);
  await server.kill('SIGTERM');
  assert.equal(await code, 1001);
});

test('Chromium lets pages of another origin open sessions and read the list only if --allow-origin names it', async () => {
  const other = await serve(data);
  const tokens = join(data, 'tokens');
  writeFileSync(tokens, 'letmein\n');
  const page = await browser.newPage({ bypassCSP: true }); // the viewer's policy forbids other origins
  await page.goto(other.url);
  for (const origin of [`http://${other.address}`, 'https://another.example']) {
    const server = await serve(data, 0, '--tokens', tokens, '--allow-origin', origin);
    const reached = await page.evaluate(async (address) => {
      const list = (headers) => fetch(`http://${address}/api/datasets`, { headers }).then((answer) => answer.status, () => 'nothing');
      const socket = new Promise((resolve) => {
        const ws = new WebSocket(`ws://${address}/v1/stream`, ['intervale.v1', `intervale.token.${btoa('letmein').replaceAll('=', '')}`]);
        ws.onopen = () => resolve('open');
        ws.onerror = () => resolve('nothing');
      });
      return [await list({ Authorization: 'Bearer letmein' }), await list({ Authorization: 'Bearer wrong' }), await list({}), await socket];
    }, server.address);
    assert.deepEqual(reached, origin.endsWith(other.address) ? [200, 401, 401, 'open'] : ['nothing', 'nothing', 'nothing', 'nothing']);
  }
});
