// Whether a camera moves, and how fast pictures follow each other meanwhile.

const kRestMs = 150; // after which the camera rests that has not moved; or twice the time from one picture to the next

export class Motion {
  private place: readonly number[] | null = null; // of the camera, when it was last seen
  private seenAt: number | null = null; // performance.now(), while it moves
  private timer = 0; // runs while it moves

  constructor(private readonly onRest: () => void) {}

  get isMoving(): boolean {
    return this.timer !== 0;
  }

  // Before each picture. place: numbers that change if the camera moves. Returns the milliseconds since the last picture if
  // the camera has moved since then, and was moving already; else null.
  sees(place: readonly number[]): number | null {
    const now = performance.now();
    const last = this.seenAt;
    const hasMoved = this.place !== null && place.some((x, i) => x !== this.place![i]);
    this.place = [...place];
    const ms = hasMoved && last !== null ? now - last : null;
    if (hasMoved) this.restAfter(Math.max(kRestMs, 2 * (ms ?? 0)));
    this.seenAt = this.isMoving ? now : null;
    return ms;
  }

  // There is no camera. Returns no time.
  rests(): null {
    window.clearTimeout(this.timer);
    this.timer = 0;
    this.place = this.seenAt = null;
    return null;
  }

  private restAfter(ms: number): void {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      this.seenAt = null;
      this.onRest();
    }, ms);
  }
}
