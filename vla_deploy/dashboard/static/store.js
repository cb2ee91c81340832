/** Hold one value that views follow. */

import { useEffect, useState } from "./ui.js";

export class Store {
  #value;
  #listeners = new Set();

  constructor(value) {
    this.#value = value;
  }

  get value() {
    return this.#value;
  }

  /** Replace the value and tell whoever follows it. */
  set(value) {
    this.#value = value;
    for (const listener of [...this.#listeners]) listener(value);
  }

  /** Call `listener` with every new value; return what ends that. */
  follow(listener) {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }
}

/** Return the value of a store, and draw again when it changes. */
export function useStore(store) {
  const [, draw] = useState(0);
  useEffect(() => {
    draw((count) => count + 1); // it may have changed between drawing and following
    return store.follow(() => draw((count) => count + 1));
  }, [store]);
  return store.value;
}
