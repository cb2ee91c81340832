/** What the camera sees now, and what is recognised in it. */

import { useColours } from "../colours.js";
import { useEasel } from "../easel.js";
import { number } from "../format.js";
import { isStale, latest } from "../live.js";
import { Card, Empty } from "../parts.js";
import { useSampled } from "../sampled.js";
import { html, useEffect, useRef, useState } from "../ui.js";
import { drawCamera, told } from "./camera_drawing.js";
import { CameraFeed } from "./camera_feed.js";

const MOST_HZ = 15;
const COLOURS = { detection: "--accent", onDetection: "--on-strong", halo: "--surface" };

/** Show the camera; `detect(header, picture)` returns the detections to draw over a picture. */
export function CameraCard({ detect }) {
  const [boxes, showBoxes] = useState(true);
  const camera = useSampled("camera", 1000);
  const scene = useSampled("scene", 1000).data;
  const seen = camera.data ? detect(camera.data) : [];
  const action = html`
    <label class="switch">
      <input type="checkbox" checked=${boxes} onChange=${(event) => showBoxes(event.target.checked)} />Detections
    </label>
  `;
  return html`
    <${Card} title="Camera" stale=${camera.stale} age_s=${camera.age_s} note=${sight(scene)} actions=${action}>
      ${camera.data ? html`<${Picture} detect=${detect} boxes=${boxes} />` : html`<${Empty} icon="robot">${why(scene)}<//>`}
      <p class="quiet small">${told(seen)}</p>
      ${(scene?.image?.faults ?? []).map((fault) => html`<p class="small" data-tone="warn">${fault}</p>`)}
    <//>
  `;
}

function Picture({ detect, boxes }) {
  const colours = useColours(COLOURS);
  const newest = useRef(null);
  const [canvas, request] = useEasel((context, size) => {
    if (!newest.current) return;
    const { picture, header } = newest.current;
    const stale = isStale(latest("camera"));
    drawCamera(context, size, picture, boxes && !stale ? detect(header) : [], colours);
  }, MOST_HZ);
  useEffect(() => {
    const feed = new CameraFeed((shown) => {
      newest.current = shown;
      request();
    });
    return () => {
      newest.current = null;
      feed.destroy();
    };
  }, [request]);
  useEffect(request, [boxes, colours, detect]);
  return html`<canvas ref=${canvas} class="camera" role="img" aria-label="Picture of the camera in the head"></canvas>`;
}

function sight(scene) {
  const model = scene?.sight?.model;
  if (!scene?.sight) return "";
  if (scene.sight.mode === "form") return `by form alone${scene.sight.why ? `: ${scene.sight.why}` : ""}`;
  return model ? `${model.model}, ${number(1000 * model.p50_s, 1)} ms` : "";
}

function why(scene) {
  const away = scene?.away?.camera ?? scene?.away?.rgbd;
  return away ? `The camera gives nothing: ${away}` : "No picture has come yet.";
}
