/** Draw the robot's links in three dimensions; draws only when something has changed. */

import { Color, DirectionalLight, GridHelper, HemisphereLight, OrbitControls, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "../vendor/three.js";
import { RobotGraph } from "./robot_graph.js";

const LEAST_MS = 1000 / 20;
const MIDDLE = new Vector3(0, 0, 0.62);
const FAR_M = 2.25;
const TURN_RAD = 0.15;
const FROM = {
  front: new Vector3(1, 0.45, 0.3),
  left: new Vector3(0.05, 1, 0.15),
  top: new Vector3(0.01, 0, 1),
};

// What a key does to the view: turn about the vertical, tilt, factor of the distance.
const KEYS = {
  ArrowLeft: [-TURN_RAD, 0, 1],
  ArrowRight: [TURN_RAD, 0, 1],
  ArrowUp: [0, -TURN_RAD, 1],
  ArrowDown: [0, TURN_RAD, 1],
  "+": [0, 0, 0.88],
  "=": [0, 0, 0.88],
  "-": [0, 0, 1.14],
};

export class JointScene {
  #canvas;
  #renderer;
  #scene = new Scene();
  #camera = new PerspectiveCamera(35, 1, 0.05, 20);
  #controls;
  #graph;
  #colours;
  #frame = 0;
  #timer = 0;
  #drawn_ms = 0;
  #seen = true;
  #observers;
  #shown = () => this.#request();
  #pressed = (event) => this.#key(event);
  #wheels = () => {
    this.#controls.enableZoom = document.activeElement === this.#canvas; // else the page scrolls
  };

  /** Raises Error where the browser has no WebGL. */
  constructor(canvas, model, colours) {
    this.#canvas = canvas;
    this.#colours = rgb(colours);
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#graph = new RobotGraph(model, this.#colours);
    this.#furnish();
    this.#camera.up.set(0, 0, 1);
    this.#controls = new OrbitControls(this.#camera, canvas);
    Object.assign(this.#controls, { enablePan: false, enableZoom: false, minDistance: 0.6, maxDistance: 6 });
    this.#controls.addEventListener("change", this.#shown);
    this.#observers = [new ResizeObserver(() => this.#resize()), new IntersectionObserver(([entry]) => this.#cross(entry))];
    for (const observer of this.#observers) observer.observe(canvas);
    document.addEventListener("visibilitychange", this.#shown);
    canvas.addEventListener("keydown", this.#pressed);
    canvas.addEventListener("focus", this.#wheels);
    canvas.addEventListener("blur", this.#wheels);
    this.lookFrom("front");
  }

  /** Set the joints to a sample of `joint_state`; an old one leaves them. */
  pose(sample, stale) {
    if (!sample || stale) return;
    this.#graph.set(sample.data.names, sample.data.position);
    this.#request();
  }

  /** Mark what a joint moves; null marks nothing. */
  choose(joint) {
    this.#graph.mark(joint, this.#colours.chosen);
    this.#request();
  }

  /** Look from "front", "left" or "top". */
  lookFrom(side) {
    this.#controls.target.copy(MIDDLE);
    this.#camera.position.copy(FROM[side]).normalize().multiplyScalar(FAR_M).add(MIDDLE);
    this.#controls.update();
    this.#request();
  }

  /** Stop for good, and give the graphics card back. */
  destroy() {
    for (const observer of this.#observers) observer.disconnect();
    document.removeEventListener("visibilitychange", this.#shown);
    this.#canvas.removeEventListener("keydown", this.#pressed);
    this.#canvas.removeEventListener("focus", this.#wheels);
    this.#canvas.removeEventListener("blur", this.#wheels);
    cancelAnimationFrame(this.#frame);
    clearTimeout(this.#timer);
    this.#seen = false;
    this.#controls.dispose();
    this.#graph.dispose();
    this.#renderer.dispose();
  }

  #furnish() {
    const grid = new GridHelper(2, 8, this.#colours.line, this.#colours.line);
    grid.rotateX(Math.PI / 2);
    grid.material.transparent = true;
    grid.material.opacity = 0.35;
    const key = new DirectionalLight(0xffffff, 1.7);
    key.position.set(1.5, 1, 2.5);
    this.#scene.add(new HemisphereLight(0xffffff, 0x8a8f98, 1.6), key, grid, this.#graph.root);
  }

  #cross(entry) {
    this.#seen = entry.isIntersecting;
    this.#request();
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    if (width === 0 || height === 0) return;
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#request();
  }

  #request() {
    if (this.#frame || this.#timer || !this.#seen || document.hidden) return;
    const wait_ms = this.#drawn_ms + LEAST_MS - performance.now();
    const plan = () => {
      this.#timer = 0;
      this.#frame = requestAnimationFrame((now_ms) => this.#draw(now_ms));
    };
    if (wait_ms > 4) this.#timer = setTimeout(plan, wait_ms);
    else plan();
  }

  #draw(now_ms) {
    this.#frame = 0;
    this.#drawn_ms = now_ms;
    this.#renderer.render(this.#scene, this.#camera);
  }

  #key(event) {
    const act = KEYS[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const [turn_rad, tilt_rad, factor] = act;
    const arm = this.#camera.position.clone().sub(this.#controls.target);
    const flat = Math.hypot(arm.x, arm.y);
    const around = Math.atan2(arm.y, arm.x) + turn_rad;
    const up = Math.min(Math.max(Math.atan2(arm.z, flat) - tilt_rad, -0.2), 1.5);
    const far = Math.min(Math.max(arm.length() * factor, 0.6), 6);
    arm.set(Math.cos(around) * Math.cos(up), Math.sin(around) * Math.cos(up), Math.sin(up)).multiplyScalar(far);
    this.#camera.position.copy(this.#controls.target).add(arm);
    this.#controls.update();
    this.#request();
  }
}

/** Return colours as three.js reads them: CSS has more ways to write one than it knows. */
function rgb(colours) {
  const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  const read = (colour) => {
    context.fillStyle = colour;
    context.fillRect(0, 0, 1, 1);
    const [red, green, blue] = context.getImageData(0, 0, 1, 1).data;
    return new Color(`rgb(${red}, ${green}, ${blue})`);
  };
  return Object.fromEntries(Object.entries(colours).map(([name, colour]) => [name, read(colour)]));
}
