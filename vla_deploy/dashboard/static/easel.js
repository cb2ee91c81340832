/**
 * Draw on a canvas only while somebody can see it.
 *
 * It keeps the canvas as sharp as the screen, draws at most `most_hz` times a second and only when
 * asked, and draws nothing while the page is hidden or the canvas is scrolled away.
 */

import { useEffect, useRef } from "./ui.js";

const MOST_PIXEL_RATIO = 2;

export class Easel {
  #canvas;
  #draw;
  #least_ms;
  #drawn_ms = -Infinity;
  #seen = false;
  #wanted = true;
  #frame = 0;
  #timer = 0;
  #resized;
  #crossed;
  #shown = () => this.request();

  /** `draw(context, size)` gets a 2-D context in CSS pixels and {width, height}. */
  constructor(canvas, draw, most_hz = 20) {
    this.#canvas = canvas;
    this.#draw = draw;
    this.#least_ms = 1000 / most_hz;
    this.#resized = new ResizeObserver(() => this.request());
    this.#crossed = new IntersectionObserver(([entry]) => {
      this.#seen = entry.isIntersecting;
      if (this.#wanted) this.request();
    });
    this.#resized.observe(canvas);
    this.#crossed.observe(canvas);
    document.addEventListener("visibilitychange", this.#shown);
  }

  /** Draw soon; several requests make one drawing. */
  request() {
    this.#wanted = true;
    if (this.#frame || this.#timer || !this.#seen || document.hidden) return;
    const wait_ms = this.#drawn_ms + this.#least_ms - performance.now();
    if (wait_ms > 4) this.#timer = setTimeout(this.#plan, wait_ms);
    else this.#plan();
  }

  /** Stop for good. */
  destroy() {
    this.#resized.disconnect();
    this.#crossed.disconnect();
    document.removeEventListener("visibilitychange", this.#shown);
    cancelAnimationFrame(this.#frame);
    clearTimeout(this.#timer);
    this.#seen = false;
  }

  #plan = () => {
    this.#timer = 0;
    this.#frame = requestAnimationFrame(this.#paint);
  };

  #paint = (now_ms) => {
    this.#frame = 0;
    this.#wanted = false;
    this.#drawn_ms = now_ms;
    const size = { width: this.#canvas.clientWidth, height: this.#canvas.clientHeight };
    if (size.width === 0 || size.height === 0) return;
    const ratio = Math.min(devicePixelRatio || 1, MOST_PIXEL_RATIO);
    fit(this.#canvas, Math.round(size.width * ratio), Math.round(size.height * ratio));
    const context = this.#canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, size.width, size.height);
    this.#draw(context, size);
  };
}

/** Return `[canvasRef, request]` of an easel that lives as long as the component. */
export function useEasel(draw, most_hz) {
  const canvas = useRef(null);
  const easel = useRef(null);
  const newest = useRef(draw);
  newest.current = draw;
  useEffect(() => {
    easel.current = new Easel(canvas.current, (...on) => newest.current(...on), most_hz);
    return () => easel.current.destroy();
  }, [most_hz]);
  const request = useRef(() => easel.current?.request()).current;
  return [canvas, request];
}

function fit(canvas, width, height) {
  if (canvas.width === width && canvas.height === height) return;
  canvas.width = width;
  canvas.height = height;
}
