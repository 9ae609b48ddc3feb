// Writes FILE.gz beside each file that becomes at least 10 % smaller, for the server to send: node compress.mjs FOLDER
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { constants, gzipSync } from 'node:zlib';

const folder = process.argv[2];
for (const entry of readdirSync(folder, { recursive: true, withFileTypes: true })) {
  if (!entry.isFile() || !/\.(css|html|js|json|svg|wasm)$/.test(entry.name)) continue;
  const path = join(entry.parentPath ?? entry.path, entry.name);
  const original = readFileSync(path);
  const compressed = gzipSync(original, { level: constants.Z_BEST_COMPRESSION });
  if (compressed.length < 0.9 * original.length) writeFileSync(`${path}.gz`, compressed);
}
