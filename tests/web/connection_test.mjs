// How the page connects: after the server is lost, and to a server that requires a token.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';

import { digestOf, eventually, fetched, kBuckyball, kGyroid, killServers, launch, makeData, open, progressOf, refusingProxy, serve, settled, throttledProxy } from './support.mjs';

let data;
let browser;
before(async () => {
  data = makeData(kBuckyball, kGyroid);
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers(); // also those that failed tests have left
});

describe('After the server is lost', () => {
  test('the page reconnects and resumes the stream without repeated updates', async () => {
    const first = await serve(data);
    const port = await throttledProxy(first.port, 20_000);
    const { page, close } = await open(browser, `http://127.0.0.1:${port}/#data=buckyball&roi=-100,-100,-100,100,100,100`);
    await page.waitForFunction(() => window.intervale.progress?.updates > 3000);
    await first.kill();
    await page.waitForFunction(() => window.intervale.live.connection.state === 'waiting');
    await eventually(async () => assert.ok(await page.isVisible('#banner')));
    const before = await progressOf(page);
    assert.ok(!before.done);
    const second = await serve(data, first.port);
    await settled(page);
    const progress = await progressOf(page);
    assert.ok(await page.evaluate(() => window.intervale.live.opened.resumed));
    assert.equal(progress.updates, await page.evaluate(() => window.intervale.live.dataset.updates));
    assert.equal(progress.repeated, 0);
    assert.ok(progress.reconnects >= 1);
    assert.equal((await digestOf(page)).digest, fetched(second, 'buckyball').digest);
    await close();
    await second.kill();
  });

  test('the banner explains it until a new server is found', async () => {
    const first = await serve(data);
    const { page, close } = await open(browser, first.url);
    await settled(page);
    await first.kill();
    await page.waitForFunction(() => window.intervale.live.connection.state === 'waiting' && window.intervale.live.connection.attempt > 1);
    await eventually(async () => assert.match(await page.textContent('#banner-text'), /\w+ \w+/));
    const second = await serve(data, first.port);
    await settled(page);
    await page.waitForSelector('#banner', { state: 'hidden' });
    await close();
    await second.kill();
  });
});

test('the reason that a server ends a session with is text, whatever is in it', async () => {
  const server = await serve(data);
  const markup = '<img src=x onerror="document.title=1">';
  for (const code of [1011, 4400, 4416]) {
    const port = await refusingProxy(server.port, code, `\u001b[2J${markup}\n\u202eend`);
    const { page, close } = await open(browser, `http://127.0.0.1:${port}/#data=buckyball`);
    await page.waitForFunction(() => document.getElementById('banner-text').textContent.includes('onerror'));
    const text = await page.textContent('#banner-text');
    assert.ok(text.includes(`?[2J${markup}??end`), text);
    assert.equal(await page.locator('img[src=x]').count(), 0);
    await close();
  }
  await server.kill();
});

test('A token that the server requires is requested from the user, and is never part of the address', async () => {
  const file = join(data, 'tokens');
  writeFileSync(file, 'open-sesame-0123456789abcdef0123456789abcdef buckyball\n', { mode: 0o600 });
  const guarded = await serve(data, 0, '--tokens', file);
  const { page, close } = await open(browser, guarded.url);
  await page.waitForSelector('#token-form');
  await eventually(async () => assert.equal(await page.isVisible('#token-error'), false));
  await page.fill('#token', 'open-simsim');
  await page.click('#token-form button[type=submit]');
  await page.waitForSelector('#token-error');
  await eventually(async () => assert.match(await page.textContent('#token-error'), /does not accept/));
  const selected = () => {
    const { activeElement: field } = document;
    return field.id === 'token' && field.selectionStart === 0 && field.selectionEnd === field.value.length;
  };
  assert.ok(await page.evaluate(selected), 'the field is selected, so that typing replaces the token');
  await page.fill('#token', 'open-sesame-0123456789abcdef0123456789abcdef');
  await page.click('#token-form button[type=submit]');
  await settled(page);
  assert.deepEqual(await page.evaluate(() => window.intervale.live.datasets.map(({ name }) => name)), ['buckyball']);
  assert.doesNotMatch(await page.evaluate(() => location.href), /sesame/);
  assert.doesNotMatch(guarded.log(), /sesame/);
  await close();
  await guarded.kill();
});
