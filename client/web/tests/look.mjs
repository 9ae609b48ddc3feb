// Takes pictures of the page with the stand-in for the worker: to be looked at. Usage: node tests/look.mjs [NAME…]
// Each goes to tests/pictures/NAME.png.
import { mkdir } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';
import { launch, openPage, settled, startStand, untilDone } from './stand.mjs';

const kPictures = {
  wide: {},
  light: { theme: 'light' },
  phone: { width: 360, height: 740 },
  'phone-open': { width: 360, height: 740, theme: 'light', act: (page) => page.click('#panel-toggle') },
  'phone-clip': { width: 360, height: 740, hash: '#data=gyroid&clip=1,0,0,3' },
  huge: { width: 3840, height: 2160 },
  clip: { hash: '#data=gyroid&clip=0.8,-0.5,0.3316625,3' },
  'clip-light': { hash: '#data=gyroid&clip=1,0,0,3', theme: 'light' },
  veil: { hash: '#data=gyroid&alpha=3d7fd6,0.35&beta=f0862a,1&box=d8c49a,0.25' },
  'veil-all': { hash: '#data=gyroid&alpha=3d7fd6,0.4&beta=f0862a,0.4&box=d8c49a,0.2', theme: 'light' },
  tets: { hash: '#data=gyroid&roi=-12,-24,-12,24,12,24&show=tets&shrink=0.75' },
  region: { hash: '#data=gyroid&roi=-12,-12,-12,12,12,12' },
  thickness: { hash: '#data=gyroid&show=thickness' },
  'thickness-clip': { hash: '#data=gyroid&show=thickness&clip=1,0,0,3', theme: 'light' },
  wire: { hash: '#data=gyroid&show=wireframe' },
  levels: { hash: '#data=gyroid&show=levels,wireframe' },
  lost: { hash: '#data=lost', never: true },
  broken: { hash: '#data=broken', theme: 'light', never: true },
  help: { act: (page) => page.keyboard.press('h') },
  panel: { theme: 'light', act: (page) => page.evaluate(() => document.querySelector('#panel').scrollTo(0, 1e4)) },
  token: { token: 'x', never: true },
};

const folder = fileURLToPath(new URL('pictures/', import.meta.url));
await mkdir(folder, { recursive: true });
const browser = await launch();
for (const name of process.argv.length > 2 ? process.argv.slice(2) : Object.keys(kPictures)) {
  const { hash = '', act, token = null, never, ...layout } = kPictures[name];
  const stand = await startStand(token);
  const page = await openPage(browser, stand.address + hash, layout);
  if (!never) await untilDone(page);
  if (act) await act(page);
  await settled(page);
  await settled(page);
  await page.screenshot({ path: `${folder}${name}.png` });
  console.log(name, JSON.stringify(await page.evaluate(() => window.intervale?.stats)), ...page.complaints);
  await page.context().close();
  stand.close();
}
await browser.close();
