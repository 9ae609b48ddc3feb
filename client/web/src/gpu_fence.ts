// Tells whether the graphics card has finished the last picture, without waiting for it.
export class GpuFence {
  private sync: WebGLSync | null = null;

  constructor(private gl: WebGL2RenderingContext) {}

  // After the commands of a picture.
  insert(): void {
    if (this.sync) this.gl.deleteSync(this.sync);
    this.sync = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
  }

  // Whether the commands before insert() are still being executed.
  get isPending(): boolean {
    if (!this.sync) return false;
    if (this.gl.getSyncParameter(this.sync, this.gl.SYNC_STATUS) !== this.gl.SIGNALED) return true;
    this.gl.deleteSync(this.sync);
    this.sync = null;
    return false;
  }

  // After the context was lost, and the fence with it.
  forget(): void {
    this.sync = null;
  }
}
