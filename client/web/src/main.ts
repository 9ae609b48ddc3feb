// The page: connects the controls, the view's state, the mesh and the picture.
import { automation } from './automation';
import { showAxes } from './axes';
import { watchBanner } from './banner';
import { ClipControls } from './clip';
import { type Dataset, fetchStatistics, listDatasets, type Listing, streamUrl } from '../package/src/datasets';
import { element, input, onClick } from './dom';
import { type FileOrAddress, Files, nameOf, watchFiles } from './files';
import { bytes } from './format';
import { Handles } from './handles';
import { type Command, listKeys, watchKeys } from './keyboard';
import { showLegend } from './legend';
import { watchMesh } from './mesh_status';
import { channelOf } from './palette';
import { kReset, watchPanel } from './panel';
import { watchPointers } from '../package/src/pointer';
import { Probe } from './probe';
import { watchProgress } from './progress';
import { rangesOf } from './range';
import { watchRanges } from './range_controls';
import { RegionControls } from './region';
import { downloadMesh, watchSaving } from './save';
import { exclusive, fromHash, kDefaults, showsValues, stylesOf, toHash, type ViewState } from './state';
import { Status } from './status';
import { Store } from './store';
import { watchTheme } from './theme';
import { ValueColors } from './value_colors';
import { Viewer } from './viewer';
import { kMostVolumeTets, VolumeControls } from './volume_controls';
import { LiveMesh, updatesIn, type Wanted } from '../package/src/live_mesh';

const kNoWebGl = 'The viewer needs WebGL 2, which this browser does not provide: it may be outdated, or hardware acceleration may be disabled.';
const kContextLost = 'The WebGL context was lost. The picture returns when the browser restores the context; the mesh is kept.';
const kFile = new URLSearchParams(location.search).get('file'); // the address of one to show; null: what the server has
const kHashDelayMs = 300; // after the last change of the view

const view = new Store<ViewState>(fromHash(location.hash));
const status = new Store<Status>(new Status());

class Page {
  private readonly handles: Handles;
  private readonly clip: ClipControls;
  private readonly region: RegionControls;
  private readonly valueColors: ValueColors;
  private readonly probe: Probe;
  private volume: VolumeControls | null = null;
  private readonly files = new Files();
  private isOpening = false; // the view is that of another data set than the mesh

  constructor(private readonly viewer: Viewer, private readonly mesh: LiveMesh) {
    this.handles = new Handles(viewer);
    this.clip = new ClipControls(view, viewer, this.handles);
    this.region = new RegionControls(view, viewer, this.handles);
    this.valueColors = new ValueColors(view, status, () => {
      viewer.invalidate();
      this.volume?.update();
    });
    this.volume = new VolumeControls(view, status, viewer, this.valueColors);
    this.probe = new Probe(view, status, viewer, this.mesh);
    this.watchViewer();
    view.watch([], (value) => {
      const chosen = value.dataset !== status.value.dataset?.name && status.value.datasets?.find(({ name }) => name === value.dataset);
      if (chosen) this.open(chosen);
      else this.updateMesh();
    });
    this.watchControls();
    watchAddress();
  }

  // What the address asks for. listing: if it was requested already.
  begin(listing?: Promise<Listing>): Promise<void> {
    return kFile === null ? this.load(listing) : this.openFile(new URL(kFile, document.baseURI), {});
  }

  // Opens the data set that the address names, or else the first.
  private async load(request = listDatasets(document.baseURI, status.value.token)): Promise<void> {
    status.set({ error: null });
    const listing = await request;
    element('token-form').hidden = !('needsToken' in listing);
    if ('needsToken' in listing) {
      element('token-error').hidden = status.value.token === null;
      input('token').focus();
      input('token').select();
      return status.set({ needsToken: true });
    }
    if ('error' in listing) return status.set({ error: listing.error });
    const datasets = [...listing.datasets, ...this.files.datasets];
    status.set({ datasets, needsToken: false });
    const { dataset: name } = view.value;
    const chosen = name === null ? datasets[0] : datasets.find((dataset) => dataset.name === name);
    if (chosen) this.open(chosen);
    else if (name !== null) status.set({ error: `The server has no data set “${name}”, which the address names. Choose another.` });
  }

  private watchViewer(): void {
    const { viewer } = this;
    viewer.onShown = (version) => {
      this.mesh.shown(version);
      status.set({ surfaceVersion: version });
    };
    viewer.onResize = viewer.onStandIn = () => this.updateMesh();
    viewer.onContext = (isLost) => status.set({ notice: isLost ? kContextLost : null });
    viewer.onDrawn = () => {
      const pose = viewer.pose();
      if (pose) showAxes(element<SVGSVGElement>('axes'), pose);
      this.handles.place();
      this.probe.refresh();
      showLegend(view.value, viewer.picture.thickness, status.value.dataset, this.valueColors.bar);
    };
  }

  private watchControls(): void {
    const { viewer } = this;
    const { canvas } = viewer.picture;
    const commands = this.commands();
    listKeys(element('keys'), commands);
    watchKeys(canvas, viewer, commands);
    watchPointers(canvas, viewer);
    onClick('reset', resetView);
    onClick('fullscreen', toggleFullScreen);
    onClick('help', showHelp);
    watchPanel(view, status);
    watchRanges(view, status, (ranges) => {
      this.mesh.preview(ranges);
      this.valueColors.preview(ranges);
    });
    watchSaving(status, viewer, this.mesh);
    watchFiles((file) => void this.openFile(file));
    watchTheme(() => {
      viewer.picture.setBackground(getComputedStyle(element('stage')).backgroundColor);
      viewer.picture.outlines.setColor(getComputedStyle(element('handles')).color);
      viewer.invalidate();
    });
    const { limitation, isAvailable } = viewer.picture.thickness;
    element('thickness-note').hidden = limitation === null;
    element('thickness-note').textContent = limitation;
    input('thickness').disabled = !isAvailable;
    element('token-form').addEventListener('submit', (event) => {
      event.preventDefault();
      element('token-error').hidden = true;
      status.set({ token: input('token').value });
      void this.load();
    });
    watchBanner(status, () => {
      const { dataset, datasets } = status.value;
      if (dataset && datasets) this.open(dataset);
      else void this.begin();
    });
  }

  private commands(): Command[] {
    return [
      { key: 'R', description: 'Reset the view', run: resetView },
      { key: 'F', description: 'Full screen', run: toggleFullScreen },
      { key: 'C', description: 'Clip plane', run: () => this.clip.toggle() },
      { key: 'G', description: 'Region at full detail', run: () => this.region.toggle() },
      { key: 'S', description: 'Shrunken tetrahedra', run: () => this.region.toggleTets() },
      { key: 'T', description: 'Thickness', run: () => toggle('thickness') },
      { key: 'O', description: 'Volume rendering', run: () => this.volume?.toggle() },
      { key: 'W', description: 'Wireframe', run: () => toggle('wireframe') },
      { key: 'L', description: 'Colour by level of detail', run: () => toggle('levels') },
      { key: 'V', description: 'Colour by value', run: toggleValueColors },
      { key: 'P', description: 'Value and position under the pointer', run: () => toggle('probe') },
      { key: 'H', description: 'This help', run: showHelp },
    ];
  }

  // null: no data set is open.
  private wanted(): Wanted | null {
    const pose = this.viewer.pose();
    if (!pose) return null;
    const { canvas } = this.viewer.picture;
    const { pixelError, region, memory, clip, tets, thickness, wireframe, probe } = view.value;
    const hides = stylesOf(view.value).every((styles) => Object.values(styles).every(({ opacity }) => opacity === 1));
    const viewport: [number, number] = [canvas.width, canvas.height];
    const { dataset } = status.value;
    const volume = view.value.render === 'volume' && this.viewer.picture.volume.isAvailable;
    const maxTets = volume ? Math.min(view.value.maxTets ?? Infinity, kMostVolumeTets) : view.value.maxTets;
    const opaque = hides && !volume && !clip && !wireframe && !tets && !thickness;
    const [ranges, uniform] = [dataset ? rangesOf(dataset, view.value) : [], volume && !!dataset?.hasRangesWithin];
    const channel = channelOf(dataset, view.value)?.name ?? null;
    const probed = probe ? (dataset?.channels ?? []).map(({ name }) => name).filter((name) => name !== channel) : [];
    return {
      view: { camera: { ...pose, viewport }, ranges, uniform, channel, probed, pixelError, region, opaque, maxTets, maxUpdates: updatesIn(memory) },
      plane: clip,
      tetsBox: tets ? region : null,
      edges: wireframe,
      values: showsValues(view.value) || probe,
      volume,
      standIn: volume ? null : this.viewer.wantedStandIn,
    };
  }

  private updateMesh(): void {
    const wanted = this.wanted();
    if (wanted && status.value.dataset && !this.isOpening) this.mesh.update(wanted);
  }

  private async loadStatistics(dataset: Dataset): Promise<void> {
    const statistics = await fetchStatistics(document.baseURI, dataset, status.value.token);
    if (status.value.dataset === dataset) status.set({ statistics });
  }

  // change: of the view, with it.
  private async openFile(file: FileOrAddress, change: Partial<ViewState> = kReset): Promise<void> {
    let notice: string | null = null;
    const tell = (text: string | null) => {
      if (status.value.notice === notice) status.set({ notice: text });
      notice = text;
    };
    const name = nameOf(file);
    status.set({ notice: null, error: null });
    tell(`Reading ${name}…`);
    let isShown = false;
    let isMissing = false; // some of what is shown
    const told = (received: number, size: number | null) => {
      isMissing = size !== null && received < size;
      tell(isShown && !isMissing ? null : `Receiving ${name}: ${bytes(received)}${size === null ? '' : ` of ${bytes(size)}`}…`);
    };
    const failed = (error: Error) => tell(`Only coarse scales are shown: ${textOf(error)}`);
    try {
      const old = this.files.datasets;
      const ofServer = (status.value.datasets ?? []).filter((dataset) => !old.includes(dataset));
      const dataset = await this.files.open(file, ofServer.map(({ name }) => name), { told, failed });
      status.set({ datasets: [...ofServer, ...this.files.datasets] });
      this.open(dataset, change);
      isShown = true;
      if (!isMissing) tell(null);
    } catch (error) {
      tell(null);
      status.set({ error: textOf(error), datasets: status.value.datasets ?? [] });
    }
  }

  // change: of the view, with it.
  private open(dataset: Dataset, change: Partial<ViewState> = {}): void {
    const file = this.files.of(dataset);
    this.isOpening = true;
    status.set({ dataset, statistics: file?.statistics ?? null, surfaceVersion: 0 });
    if (dataset.hasEveryRange && !file) void this.loadStatistics(dataset);
    this.viewer.open(dataset);
    this.clip.opened();
    this.region.opened();
    view.set({ dataset: dataset.name, ...change, ...(dataset.hasEveryRange ? {} : { ranges: kDefaults.ranges }) });
    this.isOpening = false;
    const wanted = this.wanted();
    if (!wanted) return;
    status.set({ error: null, progress: null, tets: null, connection: { state: 'connecting' } });
    this.mesh.open(file?.connect() ?? streamUrl(document.baseURI), dataset.name, wanted, status.value.token);
  }
}

const textOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

const resetView = () => view.set({ pose: null });

function toggleFullScreen(): void {
  const done = document.fullscreenElement ? document.exitFullscreen() : element('stage').requestFullscreen();
  done.catch(() => {}); // the browser may refuse
}

const showHelp = () => element<HTMLDialogElement>('help-dialog').showModal();

function toggle(name: 'wireframe' | 'levels' | 'thickness' | 'probe'): void {
  if (!input(name).disabled) view.set(exclusive({ [name]: !view.value[name] }));
}

const toggleValueColors = () => view.set(exclusive({ colorBy: view.value.colorBy === 'value' ? 'surface' : 'value' }));

// The address follows the view, and the view follows an address that the user enters.
function watchAddress(): void {
  let timer = 0;
  let last = location.hash; // as read or written
  const write = () => {
    if (location.hash !== last) return; // the user entered another one, and 'hashchange' follows
    history.replaceState(null, '', toHash(view.value) || location.pathname + location.search);
    last = location.hash;
  };
  view.watch([], () => {
    window.clearTimeout(timer);
    timer = window.setTimeout(write, kHashDelayMs);
  });
  window.addEventListener('hashchange', () => {
    last = location.hash;
    view.set(fromHash(last));
  });
}

function start(): void {
  watchProgress(status);
  let viewer: Viewer;
  // First the mesh: its worker loads the core while this thread prepares to draw.
  const mesh = new LiveMesh({ isShownLater: true });
  watchMesh(mesh, status);
  mesh.addEventListener('saved', ({ detail }) => downloadMesh(detail));
  const listing = kFile === null ? listDatasets(document.baseURI) : undefined;
  try {
    viewer = new Viewer(element<HTMLCanvasElement>('canvas'), view);
  } catch {
    mesh.close();
    watchBanner(status, () => location.reload());
    status.set({ error: kNoWebGl });
    return;
  }
  window.intervale = automation(view, status, viewer, mesh);
  viewer.watch(mesh);
  void new Page(viewer, mesh).begin(listing);
}

start();
