// Packs the package @intervale/client: node pack.mjs PAGE VERSION OUT
// PAGE: a copy of client/web with its npm packages, and the client core in package/src/core. OUT: the folder for
// intervale-client-VERSION.tgz. What is packed lies in PAGE/packed then.
import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';

const [page, version, out] = process.argv.slice(2, 5).map((word, i) => (i === 1 ? word : resolve(word)));
const from = join(page, 'package');
const to = join(page, 'packed');

// Comments of declarations as TSDoc, which type declarations and the reference keep: those before a line with code, and
// those after a member.
function withDocs(source) {
  const lines = source.split('\n');
  const documented = [];
  let block = [];
  let isHead = true; // what the file begins with is of the file
  for (const line of lines) {
    const comment = /^\s*\/\/ ?(.*)$/.exec(line);
    if (comment) {
      block.push(comment[1]);
      continue;
    }
    const indent = /^\s*/.exec(line)[0];
    if (block.length > 0) {
      const ends = isHead ? [' * @module', ' */'] : [' */'];
      documented.push(...['/**', ...block.map((text) => ` * ${text}`.trimEnd()), ...ends].map((text) => indent + text));
      block = [];
    }
    isHead = false;
    const member = /^(\s+(?:readonly |\| \{)?.*[;,{]) \/\/ (.*)$/.exec(line);
    if (member) documented.push(`${indent}/** ${member[2]} */`, member[1]);
    else documented.push(line);
  }
  return documented.join('\n');
}

rmSync(to, { recursive: true, force: true });
mkdirSync(join(to, 'src/core'), { recursive: true });
for (const entry of readdirSync(join(from, 'src'), { recursive: true })) {
  if (entry.endsWith('.ts')) writeFileSync(join(to, 'src', entry), withDocs(readFileSync(join(from, 'src', entry), 'utf8')));
}
for (const name of ['tsconfig.json', 'tsconfig.worker.json', 'README.md']) copyFileSync(join(from, name), join(to, name));
const description = JSON.parse(readFileSync(join(from, 'package.json'), 'utf8'));
writeFileSync(join(to, 'package.json'), JSON.stringify({ ...description, version }, null, 2) + '\n');

const run = (program, ...args) => execFileSync(program, args, { cwd: to, stdio: ['ignore', 'ignore', 'inherit'] });
for (const project of ['tsconfig.json', 'tsconfig.worker.json']) run(process.execPath, join(page, 'node_modules/typescript/bin/tsc'), '-p', project);
for (const name of ['core/core.js', 'core/core.wasm', 'core/local.js', 'core/local.wasm']) {
  mkdirSync(dirname(join(to, 'dist', name)), { recursive: true });
  copyFileSync(join(from, 'src', name), join(to, 'dist', name));
}
mkdirSync(out, { recursive: true });
run('npm', 'pack', '--silent', '--pack-destination', out);
