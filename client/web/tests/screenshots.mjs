// Screenshots of the page with the fake worker, for review: node tests/screenshots.mjs [NAME…]
// Each is written to tests/pictures/NAME.png.
import { mkdir } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { openPage, refined, settled, startFakeServer } from './fake_server.mjs';

// isIncomplete: the view is never completely refined.
const kPictures = {
  wide: {},
  light: { theme: 'light' },
  phone: { width: 360, height: 740 },
  'phone-open': { width: 360, height: 740, theme: 'light', act: (page) => page.click('#panel-toggle') },
  'phone-clip': { width: 360, height: 740, hash: '#data=gyroid&clip=1,0,0,3' },
  huge: { width: 3840, height: 2160 },
  clip: { hash: '#data=gyroid&clip=0.8,-0.5,0.3316625,3' },
  'clip-light': { hash: '#data=gyroid&clip=1,0,0,3', theme: 'light' },
  transparent: { hash: '#data=gyroid&alpha=3d7fd6,0.35&beta=f0862a,1&box=d8c49a,0.25' },
  'transparent-all': { hash: '#data=gyroid&alpha=3d7fd6,0.4&beta=f0862a,0.4&box=d8c49a,0.2', theme: 'light' },
  tets: { hash: '#data=gyroid&roi=-12,-24,-12,24,12,24&show=tets&shrink=0.75' },
  region: { hash: '#data=gyroid&roi=-12,-12,-12,12,12,12' },
  thickness: { hash: '#data=gyroid&show=thickness' },
  'thickness-clip': { hash: '#data=gyroid&show=thickness&clip=1,0,0,3', theme: 'light' },
  wire: { hash: '#data=gyroid&show=wireframe' },
  volume: { hash: '#data=any&render=volume&opacity=0:0.02,0.8:0.1,1.5:0.6' },
  levels: { hash: '#data=gyroid&show=levels,wireframe' },
  ranges: { hash: '#data=any&range=-1.2,-0.6,e69f00,0.4&range=0.4,1.2,009e73,1' },
  lost: { hash: '#data=lost', isIncomplete: true },
  broken: { hash: '#data=broken', theme: 'light', isIncomplete: true },
  help: { act: (page) => page.keyboard.press('h') },
  panel: { theme: 'light', act: (page) => page.evaluate(() => document.querySelector('#panel').scrollTo(0, 1e4)) },
  token: { token: 'x', isIncomplete: true },
};

const folder = fileURLToPath(new URL('pictures/', import.meta.url));
await mkdir(folder, { recursive: true });
const browser = await launch();
for (const name of process.argv.length > 2 ? process.argv.slice(2) : Object.keys(kPictures)) {
  const { hash = '', act, token = null, isIncomplete, ...layout } = kPictures[name];
  const server = await startFakeServer(token);
  const page = await openPage(browser, server.address + hash, { scale: 0.5, ...layout });
  if (!isIncomplete) await refined(page);
  if (act) await act(page);
  await settled(page);
  await settled(page);
  await page.screenshot({ path: `${folder}${name}.png` });
  console.log(name, JSON.stringify(await page.evaluate(() => window.intervale?.stats)), ...page.problems);
  await page.context().close();
  server.close();
}
await browser.close();
