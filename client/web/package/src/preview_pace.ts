// How fine a preview of a range may be so that a step of it is done in time: chosen from how many updates stay without
// the mesh's finest levels, and from how long the last steps took.

const kStepMs = 30; // for the worker's part of a step; uploading and drawing take about as long again
const kFirstMsPerUpdate = 0.0013; // until a step was measured
const kMaking = 1.5; // times as long takes a step that makes the coarse mesh first
const kLeast = 1000; // updates, if the mesh has as many: that much is always done in time

export class PreviewPace {
  levels = 0; // to leave out, of the next step
  private counts = [0];
  private makes = true; // the next step has to make the coarse mesh
  private msPerUpdate = kFirstMsPerUpdate;

  // A preview begins. counts: of updates that stay, by the number of levels left out.
  begin(counts: number[]): void {
    this.counts = counts;
    this.makes = true;
    this.levels = this.levelsFor(0);
  }

  // The worker's part of a step with `levels` left out took so long. Finer only where the next finer level would surely
  // do, so that steps do not alternate between two levels.
  took(ms: number): void {
    const { levels } = this;
    const step = this.makes ? ms / kMaking : ms;
    if (this.counts[levels]! > 0) this.msPerUpdate = step / this.counts[levels]!;
    if (step > 1.3 * kStepMs) this.levels = this.levelsFor(levels + 1);
    else if (levels > 0 && this.msOf(levels - 1) < 0.7 * kStepMs) this.levels = levels - 1;
    this.makes = this.levels !== levels;
  }

  private msOf(levels: number): number {
    return this.counts[levels]! * this.msPerUpdate;
  }

  // The fewest, from `least` on, with which a step that makes the mesh is done in time.
  private levelsFor(least: number): number {
    const most = this.counts.filter((count) => count >= kLeast).length - 1;
    let levels = least;
    while (levels < most && kMaking * this.msOf(levels) > kStepMs) ++levels;
    return Math.max(0, Math.min(levels, most));
  }
}
