// The status of the page: what it knows of the server and the mesh. Not part of the address.
import type { Dataset, Statistics } from '../package/src/datasets';
import type { ConnectionState, MeshFormat, Progress } from '../package/src/messages';
import type { NamedColors } from './palette';

export class Status {
  datasets: Dataset[] | null = null; // null: not received yet
  dataset: Dataset | null = null; // the open one
  statistics: Statistics | null = null; // of its field, where there are any
  connection: ConnectionState = { state: 'closed' };
  opened = { times: 0, resumed: false }; // how often a session was opened; whether the last one was resumed
  palettes: NamedColors[] = []; // for values, the default first; empty until the core was loaded
  progress: Progress | null = null;
  error: string | null = null; // for the user; shown with a button to try again
  needsToken = false;
  token: string | null = null; // kept in memory only
  notice: string | null = null; // for the user: information that is not an error
  surfaceVersion = 0; // shown; 0: none
  tets: { count: number; outOf: number } | null = null; // see Tets
  saving: MeshFormat | null = null; // the format that the worker is writing
}
