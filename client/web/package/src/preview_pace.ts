// How fine a preview of a range may be so that a step of it is done in time: chosen from how long the last ones took.
// The finest levels of the mesh are left out, and each has about half of its updates.

const kStepMs = 30; // for the worker's part of a step; uploading and drawing take about as long again
const kFirstMsPerUpdate = 0.002; // until a step was measured
const kMostLevels = 15; // five scales

export class PreviewPace {
  levels = 0; // to leave out, of the next step
  private isMeasured = false;

  // A preview begins. updates: of the mesh that it is a preview of.
  begin(updates: number): void {
    if (!this.isMeasured) this.adapt(updates * kFirstMsPerUpdate);
  }

  // The worker's part of a step with `levels` left out took so long.
  took(ms: number): void {
    this.isMeasured = true;
    this.adapt(ms);
  }

  // Finer only where the next finer level would surely do, so that steps do not alternate between two levels.
  private adapt(ms: number): void {
    if (ms > 1.3 * kStepMs) this.levels = Math.min(kMostLevels, this.levels + Math.max(1, Math.round(Math.log2(ms / kStepMs))));
    else if (ms < kStepMs / 3) this.levels = Math.max(0, this.levels - 1);
  }
}
