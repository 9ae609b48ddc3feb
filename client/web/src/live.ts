// What the page knows of the server and the mesh at this moment; nothing of it is kept in the address.
import type { ConnectionState, Dataset, Progress } from './messages';

export interface Listed extends Dataset {
  fullBytes: number; // of the full mesh, indexed
  refine: string;
}

export interface Live {
  datasets: Listed[] | null; // null: not known yet
  dataset: Listed | null; // that is open
  connection: ConnectionState;
  opened: { times: number; resumed: boolean }; // so far; the last time, by going on where it was
  progress: Progress | null;
  trouble: string | null; // what failed, for people; with a button to try again
  needsToken: boolean;
  token: string | null; // never written anywhere
  notice: string | null; // what is as it should be, but worth a word
  skinVersion: number;
  tets: { count: number; outOf: number } | null;
  saving: string | null; // the format that the worker is writing
}

export const kNothingYet: Live = {
  datasets: null,
  dataset: null,
  connection: { state: 'closed' },
  opened: { times: 0, resumed: false },
  progress: null,
  trouble: null,
  needsToken: false,
  token: null,
  notice: null,
  skinVersion: 0,
  tets: null,
  saving: null,
};
