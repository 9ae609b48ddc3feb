// The page: joins what is seen, what is chosen and what the worker says.
import { Automation } from './automation';
import { showAxes } from './axes';
import { watchBanner } from './banner';
import { ClipControls } from './clip';
import { listDatasets } from './datasets';
import { element, input, onClick } from './dom';
import { Handles } from './handles';
import { type Command, listKeys, watchKeys } from './keyboard';
import { showLegend } from './legend';
import { kNothingYet, type Listed, type Live } from './live';
import type { View } from './messages';
import { watchPanel } from './panel';
import { type Movable, watchPointers } from './pointer';
import { watchProgress } from './progress';
import { RegionControls } from './region';
import { downloadMesh, watchSaving } from './save';
import { Session, updatesIn } from './session';
import { fromHash, toHash, type ViewState } from './state';
import { Store } from './store';
import { watchTheme } from './theme';
import { Viewer } from './viewer';

const kPictureLost = 'The graphics card has dropped the picture; it comes back as soon as the browser lets it. The mesh is still here.';
const kHashMs = 300; // after the last change

const view = new Store<ViewState>(fromHash(location.hash));
const live = new Store<Live>(kNothingYet);
const automation = new Automation();

function start(): void {
  const canvas = element<HTMLCanvasElement>('canvas');
  let viewer: Viewer;
  // First what takes its time elsewhere: the worker loads its core while this thread makes ready to draw.
  const session = new Session(live, {
    skin: (skin) => viewer.takeSkin(skin),
    cap: (cap) => viewer.takeCap(cap),
    tets: (tets) => viewer.takeTets(tets),
    saved: downloadMesh,
    other: (report) => automation.reported(report),
  });
  const firstListing = listDatasets(null);
  try {
    viewer = new Viewer(canvas, view);
  } catch {
    session.end();
    live.set({ trouble: 'This browser does not draw with WebGL 2, which the picture needs: it may be old, or drawing by the graphics card switched off.' });
    return;
  }
  automation.expose(view, live, viewer, (request) => session.send(request));

  const movable: Movable = {
    pose: () => viewer.pose(),
    move: (pose) => view.set({ pose }),
    centre: (x, y) => viewer.centre(x, y),
  };
  const handles = new Handles(element('handles'), canvas, () => viewer.pose());
  const clip = new ClipControls(view, () => viewer.frame, () => viewer.pose(), handles);
  const region = new RegionControls(view, () => viewer.frame, () => viewer.pose(), handles);

  const wanted = (): View | null => {
    const pose = viewer.pose();
    if (!pose) return null;
    const { pixelError, region: box, maxTets, memory } = view.value;
    return { camera: { ...pose, viewport: [canvas.width, canvas.height] }, pixelError, region: box, maxTets, maxUpdates: updatesIn(memory) };
  };
  const tetsBox = () => (view.value.tets ? view.value.region : null);
  const ask = () => {
    const now = wanted();
    if (!now || !live.value.dataset) return;
    session.setView(now);
    session.setPlane(view.value.clip);
    session.setTetsBox(tetsBox());
    session.setEdges(view.value.wireframe);
  };
  const open = (dataset: Listed) => {
    live.set({ dataset, skinVersion: 0 });
    viewer.open(dataset);
    clip.opened();
    region.opened();
    view.set({ dataset: dataset.name });
    const now = wanted();
    if (now) session.open(dataset.name, { view: now, plane: view.value.clip, tetsBox: tetsBox(), edges: view.value.wireframe });
  };

  viewer.onShown = (version) => {
    session.send({ type: 'shown', version });
    live.set({ skinVersion: version });
  };
  viewer.onResize = ask;
  viewer.onContext = (lost) => live.set({ notice: lost ? kPictureLost : null });
  viewer.onDrawn = () => {
    const pose = viewer.pose();
    if (pose) showAxes(element('axes') as unknown as Element, pose);
    handles.place();
    showLegend(view.value, viewer.picture.thickness.most);
  };

  const load = async (asked = listDatasets(live.value.token)) => {
    live.set({ trouble: null });
    const listing = await asked;
    element('token-form').hidden = !('needsToken' in listing);
    if ('needsToken' in listing) {
      element('token-trouble').hidden = live.value.token === null;
      input('token').focus();
      input('token').select();
      return live.set({ needsToken: true });
    }
    if ('trouble' in listing) return live.set({ trouble: listing.trouble });
    live.set({ datasets: listing.datasets, needsToken: false });
    const { dataset: name } = view.value;
    const chosen = name === null ? listing.datasets[0] : listing.datasets.find((one) => one.name === name);
    if (chosen) open(chosen);
    else if (name !== null) live.set({ trouble: `The address asks for “${name}”, which this server does not have. Choose another.` });
  };

  view.watch([], (value) => {
    const other = value.dataset !== live.value.dataset?.name && live.value.datasets?.find((one) => one.name === value.dataset);
    if (other) open(other);
    else ask();
  });

  const reset = () => view.set({ pose: null });
  const fullScreen = () => void (document.fullscreenElement ? document.exitFullscreen() : element('stage').requestFullscreen()).catch(() => {});
  const help = () => element<HTMLDialogElement>('help-dialog').showModal();
  const flip = (name: 'wireframe' | 'levels' | 'thickness') => () => {
    if (!input(name).disabled) view.set({ [name]: !view.value[name] });
  };
  const commands: Command[] = [
    { key: 'R', does: 'Reset the view', run: reset },
    { key: 'F', does: 'Full screen', run: fullScreen },
    { key: 'C', does: 'Clip plane', run: () => clip.toggle() },
    { key: 'G', does: 'Region, refined to the end', run: () => region.toggle() },
    { key: 'S', does: 'Shrunken tetrahedra', run: () => region.toggleTets() },
    { key: 'T', does: 'Thickness', run: flip('thickness') },
    { key: 'W', does: 'Wireframe', run: flip('wireframe') },
    { key: 'L', does: 'Colour by level of detail', run: flip('levels') },
    { key: 'H', does: 'This help', run: help },
  ];
  onClick('reset', reset);
  onClick('fullscreen', fullScreen);
  onClick('help', help);
  listKeys(element('keys'), commands);
  watchKeys(canvas, movable, commands);
  watchPointers(canvas, movable);
  watchPanel(view, live);
  watchSaving(live, (request) => session.send(request), () => viewer.photograph());
  watchTheme(() => {
    viewer.picture.setBackground(getComputedStyle(element('stage')).backgroundColor);
    viewer.picture.guides.setInkOf(getComputedStyle(element('handles')).color);
    viewer.changed();
  });
  const { trouble } = viewer.picture.thickness;
  element('thickness-note').hidden = trouble === null;
  element('thickness-note').textContent = trouble;
  input('thickness').disabled = !viewer.picture.thickness.possible;

  element('token-form').addEventListener('submit', (event) => {
    event.preventDefault();
    element('token-trouble').hidden = true;
    live.set({ token: input('token').value });
    void load();
  });
  watchBanner(live, () => (live.value.dataset && live.value.datasets ? open(live.value.dataset) : void load()));
  keepAddress();
  void load(firstListing);
}

// The address follows the view, and the view an address that is typed.
function keepAddress(): void {
  let timer = 0;
  view.watch([], (value) => {
    window.clearTimeout(timer);
    timer = window.setTimeout(() => history.replaceState(null, '', toHash(value) || location.pathname + location.search), kHashMs);
  });
  window.addEventListener('hashchange', () => view.set(fromHash(location.hash)));
}

watchProgress(live);
start();
