/** The robot in three dimensions, as its joints stand now; turned by pointer, keys or buttons. */

import { useColours } from "../colours.js";
import { isStale, latest, subscribe } from "../live.js";
import { Button, Card, Empty } from "../parts.js";
import { useSampled } from "../sampled.js";
import { html, useEffect, useRef, useState } from "../ui.js";

const COLOURS = {
  ground: "--raised",
  line: "--line-strong",
  part: "--robot-part",
  dark: "--robot-dark",
  chosen: "--accent",
};
const VIEWS = [
  ["front", "Front"],
  ["left", "Side"],
  ["top", "Top"],
];

/** Show the robot; `model` is null until it has been fetched. */
export function JointCard({ model, chosen }) {
  const state = useSampled("joint_state", 1000);
  const scene = useRef(null);
  const acts = html`
    <div class="row tight">
      ${VIEWS.map(([name, words]) => html`<${Button} key=${name} kind="plain" onClick=${() => scene.current?.lookFrom(name)}>${words}<//>`)}
    </div>
  `;
  return html`
    <${Card} title="Joints in 3-D" stale=${state.stale} age_s=${state.age_s} actions=${acts}>
      ${model ? html`<${Stage} model=${model} chosen=${chosen} scene=${scene} />` : html`<${Empty} icon="robot">The robot's model has not come yet.<//>`}
      <p class="quiet small">The robot's own picture of itself: its joints as its servos report them. The table below tells the same in numbers.</p>
    <//>
  `;
}

function Stage({ model, chosen, scene }) {
  const canvas = useRef(null);
  const colours = useColours(COLOURS);
  const [trouble, setTrouble] = useState("");
  useEffect(() => {
    let ended = false;
    let stop = () => {};
    import("./joint_scene.js").then(
      ({ JointScene }) => {
        if (ended) return;
        try {
          scene.current = new JointScene(canvas.current, model, colours);
        } catch (error) {
          setTrouble(`This browser shows no 3-D: ${error.message}`);
          return;
        }
        const follow = () => scene.current.pose(latest("joint_state"), isStale(latest("joint_state")));
        const end = subscribe("joint_state", follow);
        if (latest("joint_state")) follow();
        scene.current.choose(chosen);
        stop = () => {
          end();
          scene.current.destroy();
          scene.current = null;
        };
      },
      (error) => setTrouble(`The 3-D library did not load: ${error.message}`),
    );
    return () => {
      ended = true;
      stop();
    };
  }, [model, colours]);
  useEffect(() => scene.current?.choose(chosen), [chosen]);
  if (trouble) return html`<${Empty} icon="alert">${trouble}<//>`;
  return html`
    <canvas
      ref=${canvas}
      class="stage"
      tabindex="0"
      role="application"
      aria-label="The robot in 3-D: arrow keys turn it, plus and minus zoom"
    ></canvas>
  `;
}
