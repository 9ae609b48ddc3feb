// How many triangles a picture has time for while the camera moves: learned from how long pictures took. A picture takes
// a time of its own, as for filling its pixels, and as much again for each triangle.

const kFewest = 1000; // triangles: with fewer, nothing can be recognised
// What triangles may take in any case, since coarser meshes would gain little: of the allowed time, or of what a picture
// takes without them.
const kShareOfAllowed = 0.5;
const kShareOfFixed = 0.25;
const kLeastPart = 0.1; // of the time for the whole mesh, that triangles take at least

export class FramePace {
  budget: number | null = null; // triangles of a stand-in; null: the whole mesh is drawn in time
  private learned: number | null = null; // the last budget of a stand-in that was drawn
  private all: { triangles: number; ms: number } | null = null; // of the whole mesh
  private last: { triangles: number; ms: number } | null = null; // of a stand-in

  // The whole mesh was drawn.
  drewAll(triangles: number, ms: number, allowedMs: number): void {
    if (triangles === 0) return;
    this.all = { triangles, ms };
    if (ms > allowedMs) this.budget ??= this.learned ?? atLeast((triangles * allowedMs) / ms);
    else if (ms < 0.8 * allowedMs) this.budget = null;
  }

  // A stand-in for this budget was drawn. Of two pictures the faster one counts: a slow one may be an accident.
  drewStandIn(triangles: number, ms: number, allowedMs: number): void {
    const { all, budget, last } = this;
    if (!all || budget === null) return;
    this.last = { triangles, ms };
    if (last?.triangles !== triangles || all.triangles <= triangles) return;
    const least = Math.min(ms, last.ms);
    const each = Math.max((all.ms - least) / (all.triangles - triangles), (kLeastPart * all.ms) / all.triangles);
    const fixed = least - each * triangles;
    const room = Math.max(allowedMs - fixed, kShareOfAllowed * allowedMs, kShareOfFixed * fixed);
    const wanted = atLeast(room / each);
    // Another one only if it differs much, so that they do not alternate.
    if (wanted > budget / 1.25 && wanted < 1.5 * budget) return;
    this.budget = this.learned = wanted;
  }
}

const atLeast = (triangles: number): number => Math.max(kFewest, Math.round(triangles));
