// Headless Chromium (INTERVALE_CHROMIUM) with software rendering, and the pixels of the page's canvas. For these tests
// and for tests/web. Edges of the canvas are not smoothed: in software that takes three quarters of the time.
import { chromium } from 'playwright-core';

export const launch = () =>
  chromium.launch({
    executablePath: process.env.INTERVALE_CHROMIUM ?? '/usr/bin/chromium-headless-shell',
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--webgl-antialiasing-mode=none'],
  });

// The canvas without handles and outlines, as PNG in base64.
export const photograph = (page) =>
  page.evaluate(async () => {
    const blob = await window.intervale.photograph();
    return new Promise((resolve) => {
      const reader = new FileReader();
      reader.onload = () => resolve(reader.result.split(',')[1]);
      reader.readAsDataURL(blob);
    });
  });

// A PNG's pixels: width, height, and data with red, green, blue and alpha of each pixel, row by row from the top.
export async function decode(page, png) {
  const { width, height, data } = await page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d', { willReadFrequently: true }); // in memory
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    let text = '';
    for (let i = 0; i < data.length; i += 32768) text += String.fromCharCode(...data.subarray(i, i + 32768));
    return { width: bitmap.width, height: bitmap.height, data: btoa(text) };
  }, png);
  return { width, height, data: Buffer.from(data, 'base64') };
}

export const pixels = async (page) => decode(page, await photograph(page));

// How much two decoded pictures differ. mean: absolute difference over all pixels and channels, 0 to 255; share:
// fraction of the pixels that differ by more than `threshold` in a channel.
export function difference(a, b, threshold = 24) {
  if (a.width !== b.width || a.height !== b.height) return { mean: 255, share: 1 };
  let sum = 0;
  let different = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    const channels = [0, 1, 2].map((c) => Math.abs(a.data[i + c] - b.data[i + c]));
    sum += channels[0] + channels[1] + channels[2];
    if (Math.max(...channels) > threshold) ++different;
  }
  const count = a.data.length / 4;
  return { mean: sum / count / 3, share: different / count };
}

// The fraction of the pixels for which predicate(red, green, blue) holds.
export function share(picture, predicate) {
  let n = 0;
  for (let i = 0; i < picture.data.length; i += 4) if (predicate(picture.data[i], picture.data[i + 1], picture.data[i + 2])) ++n;
  return (4 * n) / picture.data.length;
}

// Until an assertion holds, for up to 15 s: texts and controls follow with the next frame, which may take long.
export async function eventually(assertion) {
  for (const end = Date.now() + 15_000; ; await new Promise((resolve) => setTimeout(resolve, 50))) {
    try {
      return await assertion();
    } catch (error) {
      if (Date.now() > end) throw error;
    }
  }
}
