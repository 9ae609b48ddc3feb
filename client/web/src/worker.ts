// Stands in for the worker until the client core is compiled to WebAssembly: says so, in words.
import type { Report } from './messages';

const report: Report = { type: 'error', text: 'This build of the page has no client core.' };
self.onmessage = () => self.postMessage(report);
