// An observable record. Watchers are called synchronously, in the order in which they were added.
export class Store<T extends object> {
  private watchers: ((value: Readonly<T>, changed: ReadonlySet<keyof T>) => void)[] = [];

  constructor(private current: T) {}

  get value(): Readonly<T> {
    return this.current;
  }

  set(change: Partial<T>): void {
    const names = Object.keys(change) as (keyof T)[];
    const changed = new Set(names.filter((name) => !Object.is(this.current[name], change[name])));
    if (changed.size === 0) return;
    this.current = { ...this.current, ...change };
    for (const watcher of this.watchers) watcher(this.current, changed);
  }

  // Calls the watcher now, and after each change of one of these names; none: of any name.
  watch(names: (keyof T)[], watcher: (value: Readonly<T>) => void): void {
    this.watchers.push((value, changed) => {
      if (names.length === 0 || names.some((name) => changed.has(name))) watcher(value);
    });
    watcher(this.current);
  }
}
