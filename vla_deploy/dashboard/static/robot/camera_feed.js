/** Decode the camera's pictures: the newest one only, and none while nobody looks. */

import { subscribe } from "../live.js";

export class CameraFeed {
  #onPicture;
  #picture = null;
  #waiting = null;
  #busy = false;
  #ended = false;
  #end;

  /** Call `onPicture({picture, header})` for each picture; it is closed when the next has come. */
  constructor(onPicture) {
    this.#onPicture = onPicture;
    this.#end = subscribe("camera", ({ data }) => this.#take(data));
  }

  /** Stop for good. */
  destroy() {
    this.#ended = true;
    this.#end();
    this.#picture?.close();
    this.#picture = null;
  }

  async #take(frame) {
    if (document.hidden || this.#ended) return;
    this.#waiting = frame; // what has not been decoded yet is passed over
    if (this.#busy) return;
    this.#busy = true;
    while (this.#waiting && !this.#ended) {
      const { payload, ...header } = this.#waiting;
      this.#waiting = null;
      const picture = await decoded(payload);
      if (picture) this.#show(picture, header);
    }
    this.#busy = false;
  }

  #show(picture, header) {
    if (this.#ended) {
      picture.close();
      return;
    }
    const before = this.#picture;
    this.#picture = picture;
    this.#onPicture({ picture, header });
    before?.close();
  }
}

async function decoded(payload) {
  try {
    return await createImageBitmap(new Blob([payload], { type: "image/jpeg" }));
  } catch (error) {
    console.warn("a picture of the camera could not be decoded", error);
    return null;
  }
}
