// The status of the page: what it knows of the server and the mesh. Not part of the address.
import type { Dataset } from './datasets';
import type { ConnectionState, Progress } from './messages';

export interface Status {
  datasets: Dataset[] | null; // null: not received yet
  dataset: Dataset | null; // the open one
  connection: ConnectionState;
  opened: { times: number; resumed: boolean }; // how often a session was opened; whether the last one was resumed
  progress: Progress | null;
  error: string | null; // for the user; shown with a button to try again
  needsToken: boolean;
  token: string | null; // kept in memory only
  notice: string | null; // for the user: information that is not an error
  surfaceVersion: number; // shown; 0: none
  tets: { count: number; outOf: number } | null; // see Tets
  saving: string | null; // the format that the worker is writing
}

export const kInitialStatus: Status = {
  datasets: null,
  dataset: null,
  connection: { state: 'closed' },
  opened: { times: 0, resumed: false },
  progress: null,
  error: null,
  needsToken: false,
  token: null,
  notice: null,
  surfaceVersion: 0,
  tets: null,
  saving: null,
};
