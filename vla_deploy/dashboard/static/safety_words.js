/** Say control's state in words, and how grave it is. */

import { sentence, words } from "./format.js";

const STATES = {
  armed: { title: "Armed", tone: "ok", icon: "check", means: "Ready: motors are under control." },
  disarmed: { title: "Disarmed", tone: "info", icon: "power", means: "No motion. Arm it to work." },
  protective_stop: {
    title: "Protective stop",
    tone: "warn",
    icon: "shield",
    means: "It stands still, and goes on once the cause has gone.",
  },
  stopping: { title: "Stopping", tone: "bad", icon: "hand", means: "It comes to rest." },
  stopped: { title: "Stopped", tone: "bad", icon: "hand", means: "Reset it, then arm it." },
  fault: {
    title: "Fault",
    tone: "bad",
    icon: "alert",
    means: "It cannot be armed before the cause is gone.",
  },
};

const SILENT = {
  title: "Unknown",
  tone: "bad",
  icon: "question",
  means: "Control is silent: nobody knows what the robot does.",
};

// Where a name as words says too little: what has happened, in one sentence.
const CAUSES = {
  estop: "Emergency stop",
  standstill_motion: "It was moved while it had to stand still",
  servo_bus_lost: "A servo bus does not answer",
  can_bus_lost: "A wheel drive's bus does not answer",
  servo_hardware_error: "A servo reports a hardware error",
  drive_fault: "A wheel drive reports a fault",
  servo_watchdog_tripped: "A servo's watchdog has tripped: control was silent",
  joint_unpowered: "A joint has let go by itself",
  encoder_jump: "A joint's encoder has jumped",
  joint_position_limit: "A joint is beyond its range",
  joint_velocity_limit: "A joint moves too fast",
  following_error: "A joint does not follow its setpoint",
  wheel_following_error: "A wheel does not follow its setpoint",
  joint_current_limit: "A joint takes too much current",
  joint_temperature_limit: "A joint is too hot",
  collision: "It has met something",
  supervisor_lost: "The supervisor is silent",
  joint_voltage_limit: "The supply voltage is out of range",
  self_collision: "Two of its parts come too close",
  environment_collision: "A part comes too close to its surroundings",
  workspace: "A part leaves the workspace",
  tip_over: "It may tip over",
  budget_exhausted: "The computer is at the end of its budget",
  stale_scan: "The lidar is silent: the base stands",
  stale_depth: "The depth camera is silent: the base stands",
  stale_pose: "Nobody tells where it is: the base stands",
  stale_imu: "The IMU is silent: the base stands",
  stale_command: "Whoever drives the base is silent: it stands",
  keep_out_zone: "It is in a keep-out zone",
  obstacle_stop_zone: "Something is in the stop zone",
  obstacle_slow_zone: "Something is in the slow-down zone",
  obstacle_limit_zone: "Something is in the limit zone",
  obstacle_approach: "It approaches something",
  tip_margin: "It leans, and drives slower",
};

const REACTIONS = {
  base_slow: "Base slowed down",
  base_block: "Base kept from going there",
  base_ramp: "Base brought to rest",
  protective_stop: "Protective stop, ends with its cause",
  hold: "Stop category 2: it stands under power",
  base_off: "It stands under power, the wheels without",
  group_stop: "Stop by the category of each joint group",
};

/** Return `{title, tone, icon, means, cause}` of a control status that is live, else of silence. */
export function safetyWords(control, stale) {
  if (!control || stale) return { ...SILENT, cause: "" };
  const state = STATES[control.state] ?? { ...SILENT, title: sentence(control.state) };
  return { ...state, ...slowed(control, state), cause: causeWords(control.cause) };
}

/** Return a cause as a sentence. */
export function causeWords(cause) {
  return cause ? (CAUSES[cause] ?? sentence(cause)) : "";
}

/** Return what is done about a cause, in words. */
export function reactionWords(reaction) {
  return REACTIONS[reaction] ?? sentence(reaction);
}

/** Return what the rules leave the base of an armed robot: lines, none for everything. */
export function boundsWords(control) {
  if (control.state !== "armed") return [];
  const lines = [];
  if (control.speed_ratio < 1) {
    lines.push(`Base at most ${Math.round(100 * control.speed_ratio)} % of its speed`);
  }
  if (control.blocked?.length) lines.push(`Base not ${control.blocked.map(words).join(", ")}`);
  return lines;
}

/** Return whether control has verified its last stop: `{failed, text}`, or null before the first. */
export function lastStopWords(stop) {
  if (!stop) return null;
  const who = `${causeWords(stop.cause)}${stop.source ? ` (${words(stop.source)})` : ""}`;
  const outcome = {
    in_progress: "in progress",
    verified: `VERIFIED, at rest after ${stop.standstill_s?.toFixed(2)} s`,
    failed: `FAILED: ${stop.reason}`,
  }[stop.state];
  return { failed: stop.state === "failed", text: `Last stop: ${outcome}. ${who}, ${Math.round(stop.age_s)} s ago` };
}

function slowed(control, state) {
  if (control.state !== "armed" || !control.cause) return {};
  return { tone: "warn", icon: "alert", means: boundsWords(control).join(". ") || state.means };
}

// Units of `measured` and `limit`; a cause that is not here has numbers without one, or none.
const UNITS = {
  standstill_motion: "rad/s",
  servo_bus_lost: "s",
  can_bus_lost: "s",
  joint_velocity_limit: "rad/s",
  wheel_following_error: "rad/s",
  joint_current_limit: "of stall current",
  joint_temperature_limit: "°C",
  supervisor_lost: "s",
  joint_voltage_limit: "V",
  self_collision: "m",
  environment_collision: "m",
  workspace: "m",
  stale_scan: "s",
  stale_depth: "s",
  stale_pose: "s",
  stale_imu: "s",
  stale_command: "s",
  keep_out_zone: "m",
  obstacle_stop_zone: "m",
  obstacle_slow_zone: "m",
  obstacle_limit_zone: "m",
  obstacle_approach: "s",
};

/** Return the unit of a cause's numbers, or "". */
export function unitOf(cause) {
  return UNITS[cause] ?? "";
}
