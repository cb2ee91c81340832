/** Reset and arm: two acts, each by itself; reset moves nothing, and arming starts no motion. */

import { post } from "../api.js";
import { useAct } from "../asking.js";
import { confirmed } from "../dialog.js";
import { tell } from "../messages.js";
import { Button } from "../parts.js";
import { html } from "../ui.js";

const ACTS = {
  reset: {
    text: "Reset",
    icon: "reset",
    done: "It is reset, and stays disarmed.",
    question: {
      title: "Reset the emergency stop?",
      text: "Somebody pressed it for a reason. Reset when you see that the reason is gone. Nothing moves: arming is an act of its own.",
    },
    asks: (control) => control?.estop_latched,
  },
  arm: {
    text: "Arm",
    icon: "power",
    done: "It is armed.",
    question: {
      title: "Arm the robot?",
      text: "Its motors hold the pose that they have. Nothing moves now, but from then on a command does move it: see that nobody is within reach.",
    },
    asks: () => true,
  },
  disarm: {
    text: "Disarm",
    icon: "power",
    done: "It is disarmed.",
    kind: "danger",
    question: {
      title: "Disarm the robot?",
      text: "It takes the power from the motors: an arm that is up sinks or falls, and what a hand holds may drop.",
    },
    asks: () => true,
  },
};

// Which acts each state offers, the one that comes next first.
const OFFERED = {
  stopping: ["reset", "arm"],
  stopped: ["reset", "arm"],
  fault: ["reset", "arm"],
  disarmed: ["arm"],
  armed: ["disarm"],
  protective_stop: ["disarm"],
};
const NOT_YET = { stopping: ["reset", "arm"], stopped: ["arm"], fault: ["arm"] };
const WHY_NOT = { reset: "It comes to rest first", arm: "Reset first" };

export function Acts({ control, stale }) {
  const offered = (!stale && OFFERED[control?.state]) || ["reset", "arm", "disarm"];
  const barred = stale ? offered : (NOT_YET[control.state] ?? []);
  return html`
    <div class="safety-acts" role="group" aria-label="Acts">
      ${offered.map(
        (name, place) => html`
          <${Act}
            key=${name}
            name=${name}
            control=${control}
            why=${barred.includes(name) ? (stale ? "Control is silent" : WHY_NOT[name]) : ""}
            isNext=${place === 0 && name !== "disarm"}
          />
        `,
      )}
    </div>
  `;
}

function Act({ name, control, why, isNext }) {
  const { text, icon, done, question, asks, kind } = ACTS[name];
  const [act, isBusy] = useAct(async () => {
    const agreed = !asks(control) || (await confirmed({ ...question, act: text, kind: kind ?? "main" }));
    if (!agreed) return;
    await post(name);
    tell("info", done);
  });
  return html`
    <${Button} needs="operator" kind=${isNext ? "main" : (kind ?? "usual")} icon=${icon} busy=${isBusy} disabled=${Boolean(why)} title=${why} onClick=${act}>
      ${text}
    <//>
  `;
}
